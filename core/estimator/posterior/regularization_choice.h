#pragma once

// Chooses the regularization weight α² of (56) by a rule of bayes/regularization.h or
// bayes/l_curve.h, on the expansion around the posterior of α² = 1. The rules do not consider an α²
// that pulls the minimum out of the region in which the expansion is trusted.

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "core/bayes/minimizer.h"
#include "core/bayes/regularization.h"
#include "core/common/types.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/problem/resolved_problem.h"
#include "polyest/stop.h"

namespace polyest::internal {

// The minima of the cost on one expansion as a function of α². Each is searched from the previous
// one and from the expansion's reference. `expansion` and `stop` must outlive it.
class RegularizedMinima {
 public:
  RegularizedMinima(const RegionalExpansion& expansion, const Stop& stop);

  // Returns the minimum for α² = `regularization`. Returns nothing if the minimum leaves the region
  // in which the expansion is trusted, or after a stop request.
  std::optional<RegularizedMinimum> At(double regularization);

  // Returns At as a function, for the rules.
  MinimumAt Function();

 private:
  // Whether `eta` lies at the edge of the box in which the expansion is trusted, which is not an
  // edge of Ω.
  bool HeldByEdge(const MinimizationProblem& search, const Vector& eta) const;

  const RegionalExpansion& expansion_;
  const Stop& stop_;
  Matrix starts_;
};

// The choice of each rule, from one sweep over the rules' range of α². The arguments must outlive
// it.
class RegularizationRules {
 public:
  RegularizationRules(const ResolvedProblem& problem, const RegionalExpansion& expansion,
                      const Stop& stop);

  // Returns the choice of the rule. After a stop request it is meaningless.
  RegularizationChoice Choose(RegularizationMode mode);

 private:
  RegularizationChoice Discrepancy();

  const ResolvedProblem& problem_;
  const RegionalExpansion& expansion_;
  RegularizedMinima minima_;
  std::string no_effect_;  // why α² has no effect, or empty
  std::vector<RegularizedMinimum> points_;
};

// Returns the choice of the problem's own rule (not FIXED) for an estimate. Returns an error only
// on a stop request.
absl::StatusOr<RegularizationChoice> ChooseRegularization(const ResolvedProblem& problem,
                                                          const RegionalExpansion& expansion,
                                                          const Stop& stop);

}  // namespace polyest::internal
