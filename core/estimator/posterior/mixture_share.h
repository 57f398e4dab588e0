#pragma once

// The share of the posterior that belongs to a mixture component. The regions of components may
// overlap. To count nothing twice, each point ξ belongs to exactly one component, the one in whose
// region it is most central,
//   argmin_k ‖η_k(ξ)‖_∞,   η_k ∈ [−1, 1]^n the coordinates of component k's region,
// the first one if several are equal. A point that lies in any component's sampling box also lies
// in its owner's.
//
// A component's weight is its evidence, the integral of the density over its share,
//   log Z_k = log ∫ e^{−J_k(ξ)} dξ − c_k.
// c_k makes the costs comparable. It is Σ ½ log σ² of the component's own noise, plus the mean over
// the check points of ΔJ, the change of the cost's height by the expansion's own error
// (reexpansion.h). If the check points do not determine that mean, c_k instead uses R, which
// includes the expansion's error, in place of σ². A discounted sample then neither gains nor loses
// in the mean, to first order in the discount.

#include <vector>

#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/posterior/posterior_draws.h"

namespace polyest::internal {

class MixturePartition {
 public:
  // Takes one design per component, at least one.
  explicit MixturePartition(const std::vector<const ExpansionDesign*>& designs);

  // Returns for each row of `xis` (W × n, germ coordinates) whether it belongs to the component.
  std::vector<bool> Owned(size_t component, const Matrix& xis) const;

 private:
  std::vector<Region> regions_;
};

struct MixtureShare {
  double owned = 1;         // share of the component's draws that belong to it
  double height = 0;        // c_k: J_k + c_k is comparable among components
  double log_evidence = 0;  // −∞ if it owns no draw
};

// Returns the component's share from draws of the cost on the expansion. Removes the draws and
// minima that belong to other components, except that a component that owns no draw keeps all.
MixtureShare TakeShare(const MixturePartition& partition, size_t component,
                       const RegionalExpansion& expansion, const Cost& cost, PosteriorDraws& draws);

// Returns exp(log_evidence) scaled to Σ = 1; equal weights if no component has evidence.
std::vector<double> WeightsOf(const std::vector<double>& log_evidence);

}  // namespace polyest::internal
