#pragma once

// Correlated priors by a Gaussian copula (R. Nelsen, An Introduction to Copulas, Springer 2006):
// the correlated parameters' scores z are jointly normal with unit variances and the correlation
// matrix P, and each is mapped to the parameter of the same cumulative probability. So marginal
// densities stay what they are, and a coefficient is that of the scores (for two normal
// parameters, or of two lognormal ones' logarithms, their own); Spearman's is (6/π) asin(P_ij/2).

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/bayes/uncertain_parameter.h"
#include "core/common/types.h"

namespace polyest {

struct Correlation {
  std::string first, second;  // names of two uncertain parameters
  double coefficient = 0;     // −1 < coefficient < 1
};

// P: pairs not listed have 0. INVALID_ARGUMENT names the pair and the rule: names that are
// uncertain parameters and differ, each pair once, coefficients between −1 and 1, a matrix P with
// no eigenvalue below 10⁻⁸ (positive definite, and by more than rounding).
absl::StatusOr<Matrix> CorrelationMatrix(const std::vector<UncertainParameter>& parameters,
                                         const std::vector<Correlation>& correlations);

}  // namespace polyest
