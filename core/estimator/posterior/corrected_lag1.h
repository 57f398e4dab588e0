#pragma once

// What a fit takes from the lag-1 correlation r of the residuals, which is to be added to it again.
//
// The residuals of a fit are (I − H) u of the errors u, H the projection onto the derivatives c_kᵀ
// ∂φ of the predictions. For white errors of the variance 1, with the sums of ChannelSums (N
// samples, the last of which the differences do not hold),
//
//   E Σ u_k²            = N − t,        t  = tr(C ∂φᵀ G ∂φ),
//   E Σ (u_k − u_{k−1})² = 2 N − 1 − t_Δ,  t_Δ = tr(C ∂φᵀ G_Δ ∂φ),
//
// to first order in the parameters, where C⁻¹ is the sum of all channels' ∂φᵀ G ∂φ and the prior's
// precision. So
// r = 1 − Σ (u_k − u_{k−1})²/(2 Σ u_k²) is too small by (t − t_Δ/2 − ½)/(N − t). Predictions that
// change little from one sample to the next have t_Δ ≈ 0 and lose t/N; those of an input that is
// white itself have t_Δ ≈ 2 t and lose nothing.

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
