#pragma once

// What of the posterior is a mixture component's own. The regions of components may overlap; so
// that nothing is counted twice, each point ξ belongs to one of them, the one in whose region it is
// most central,
//   argmin_k ‖η_k(ξ)‖_∞,   η_k ∈ [−1, 1]^n the coordinates of component k's region,
// the first of equals. A point that lies in anybody's box of draws lies in its owner's.
//
// A component's weight is its evidence, the integral of the density over what is its own,
//   log Z_k = log ∫ e^{−J_k(ξ)} dξ − c_k.
// c_k makes costs comparable: Σ ½ log σ² of the component's own noise, and what its expansion's own
// error has made of its cost's height, ΔJ in the mean over its check points (reexpansion.h). Where
// those do not tell, R with the expansion's error in place of σ², by which a discounted sample is
// neither won nor lost in the mean, to first order in the discount.

#include <vector>

#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/posterior/posterior_draws.h"

namespace polyest::internal {

class MixturePartition {
 public:
  // One design a component, at least one.
  explicit MixturePartition(const std::vector<const ExpansionDesign*>& designs);

  // Of each row of xis (W × n, germ coordinates): whether it is the component's.
  std::vector<bool> Owned(size_t component, const Matrix& xis) const;

 private:
  std::vector<Region> regions_;
};

struct MixtureShare {
  double owned = 1;         // of the component's draws
  double height = 0;        // c_k: J_k + c_k may be compared among components
  double log_evidence = 0;  // −∞ where it owns none
};

// Of draws of the cost on the expansion. What is left of the draws and their minima afterwards is
// the component's own; all of them where it owns no draw.
MixtureShare TakeShare(const MixturePartition& partition, size_t component,
                       const RegionalExpansion& expansion, const Cost& cost, PosteriorDraws& draws);

// exp(log_evidence), Σ = 1; equal where none has any.
std::vector<double> WeightsOf(const std::vector<double>& log_evidence);

}  // namespace polyest::internal
