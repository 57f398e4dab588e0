#pragma once

// Correlated priors by a Gaussian copula (R. Nelsen, An Introduction to Copulas, Springer 2006):
// the correlated parameters' scores z are jointly normal with unit variances and the correlation
// matrix P, and each is mapped to the parameter of equal cumulative probability. Marginal densities
// therefore do not change. A coefficient is that of the scores, which for two normal parameters, or
// the logarithms of two lognormal ones, is their own; Spearman's coefficient is (6/π) asin(P_ij/2).

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/common/types.h"
#include "polyest/uncertain_parameter.h"

namespace polyest::internal {

// Returns P; pairs that are not listed have 0. Returns INVALID_ARGUMENT, naming the pair and the
// rule, unless the names of each pair are those of two different uncertain parameters, each pair
// occurs once, coefficients lie between −1 and 1, and no eigenvalue of P is below 10⁻⁸ (positive
// definite by more than rounding).
absl::StatusOr<Matrix> CorrelationMatrix(const std::vector<UncertainParameter>& parameters,
                                         const std::vector<Correlation>& correlations);

}  // namespace polyest::internal
