#pragma once

// The regularization weight α² of (56) that a rule of bayes/regularization.h or bayes/l_curve.h
// chooses, on the expansion where the posterior of α² = 1 is. The rules do not look at an α² that
// pulls the minimum out of the region in which the expansion is trusted.

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

// The minima of the cost on one expansion over α², each looked for from the one before and from the
// expansion's reference. `expansion` and `stop` outlive it.
class RegularizedMinima {
 public:
  RegularizedMinima(const RegionalExpansion& expansion, const Stop& stop);

  // The minimum for α² = `regularization`; nothing where it leaves the region in which the
  // expansion is trusted, and after a stop request.
  std::optional<RegularizedMinimum> At(double regularization);

  // At(), for the rules.
  MinimumAt Function();

 private:
  // Whether `eta` lies at the edge of the box in which the expansion is trusted, which is not an
  // edge of Ω.
  bool HeldByEdge(const MinimizationProblem& search, const Vector& eta) const;

  const RegionalExpansion& expansion_;
  const Stop& stop_;
  Matrix starts_;
};

// What each rule chooses, from one sweep over the rules' range of α². The arguments outlive it.
class RegularizationRules {
 public:
  RegularizationRules(const ResolvedProblem& problem, const RegionalExpansion& expansion,
                      const Stop& stop);

  // After a stop request the choice is meaningless.
  RegularizationChoice Choose(RegularizationMode mode);

 private:
  RegularizationChoice Discrepancy();

  const ResolvedProblem& problem_;
  const RegionalExpansion& expansion_;
  RegularizedMinima minima_;
  std::string no_effect_;  // why α² has none, or empty
  std::vector<RegularizedMinimum> points_;
};

// The choice of the problem's own rule (not FIXED) for an estimate. Only a stop request makes it
// not OK.
absl::StatusOr<RegularizationChoice> ChooseRegularization(const ResolvedProblem& problem,
                                                          const RegionalExpansion& expansion,
                                                          const Stop& stop);

}  // namespace polyest::internal
