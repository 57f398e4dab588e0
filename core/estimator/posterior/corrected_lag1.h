#pragma once

// What a fit takes from the lag-1 correlation r of the residuals, which is to be added to it again.
//
// The residuals of a fit are (I − H) u, where u are the errors and H projects onto the derivatives
// c_kᵀ ∂φ of the predictions. For white errors of variance 1 and the sums of ChannelSums, over N
// samples of one run,
//
//   E Σ u_k²            = N − t,        t  = tr(C ∂φᵀ G ∂φ),
//   E Σ (u_k − u_{k−1})² = 2 N − 1 − t_Δ,  t_Δ = tr(C ∂φᵀ G_Δ ∂φ),
//
// to first order in the parameters. C⁻¹ is the sum of ∂φᵀ G ∂φ over all channels and of the prior's
// precision. Hence r = 1 − Σ (u_k − u_{k−1})²/(2 Σ u_k²) is too small by (t − t_Δ/2 − ½)/(N − t).
// Predictions that change little from one sample to the next have t_Δ ≈ 0, and r loses t/N. Those
// of a white input have t_Δ ≈ 2 t, and r loses nothing.

#include <vector>

#include "core/bayes/cost.h"
#include "core/common/types.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

class CorrectedLag1 {
 public:
  // Of a fit at η (local coordinates). The expansion must outlive it.
  CorrectedLag1(const Cost& cost, const RegionalExpansion& expansion, const ConstVectorRef& eta);

  // Returns r of the channel, −1 … 1, corrected; 0 for fewer than two samples. Parameters that have
  // been eliminated count as levels of runs of equal length.
  double Of(int channel) const;

 private:
  const RegionalExpansion& expansion_;
  Vector d_;          // φ(η) − φ of the reference, S
  Vector precision_;  // of each channel's noise, in units of the working noise's; m
  Matrix spread_;     // ∂φ C^½, S × n
};

}  // namespace polyest::internal
