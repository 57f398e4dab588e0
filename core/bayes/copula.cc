#include "core/bayes/copula.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <set>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr double kMinEigenvalue = 1e-8;

absl::StatusOr<Eigen::Index> Find(const std::vector<UncertainParameter>& parameters,
                                  const std::string& field, const std::string& name) {
  const auto found = std::ranges::find(parameters, name, &UncertainParameter::name);
  if (found != parameters.end()) return found - parameters.begin();
  std::vector<std::string> names;
  for (const UncertainParameter& parameter : parameters) names.push_back(parameter.name);
  return InvalidField(field, absl::StrFormat("unknown parameter \"%s\"; uncertain are %s", name,
                                             absl::StrJoin(names, ", ")));
}

absl::Status CheckPositiveDefinite(const Matrix& matrix,
                                   const std::vector<Correlation>& correlations) {
  const double least = SymmetricEigenvalues(matrix)[0];
  if (least >= kMinEigenvalue) return absl::OkStatus();
  std::vector<std::string> pairs;
  for (const Correlation& pair : correlations) {
    pairs.push_back(absl::StrFormat("%s and %s %g", pair.first, pair.second, pair.coefficient));
  }
  return InvalidField(
      "correlations",
      absl::StrFormat("%s: no parameters can be correlated like this together; the "
                      "matrix of the coefficients has the eigenvalue %.3g and must be "
                      "positive definite, with none below %g",
                      absl::StrJoin(pairs, ", "), least, kMinEigenvalue));
}

}  // namespace

absl::StatusOr<Matrix> CorrelationMatrix(const std::vector<UncertainParameter>& parameters,
                                         const std::vector<Correlation>& correlations) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  Matrix matrix = Matrix::Identity(n, n);
  std::set<std::pair<Eigen::Index, Eigen::Index>> seen;
  for (size_t k = 0; k < correlations.size(); ++k) {
    const Correlation& pair = correlations[k];
    const std::string field = absl::StrFormat("correlations[%d]", k);
    POLYEST_ASSIGN_OR_RETURN(const Eigen::Index i, Find(parameters, field, pair.first));
    POLYEST_ASSIGN_OR_RETURN(const Eigen::Index j, Find(parameters, field, pair.second));
    if (i == j) {
      return InvalidField(field,
                          absl::StrFormat("%s cannot be correlated with itself", pair.first));
    }
    if (!seen.insert(std::minmax({i, j})).second) {
      return InvalidField(field,
                          absl::StrFormat("%s and %s are given twice", pair.first, pair.second));
    }
    if (!(pair.coefficient > -1 && pair.coefficient < 1)) {
      return InvalidField(field,
                          absl::StrFormat("coefficient %g of %s and %s must lie between -1 and 1",
                                          pair.coefficient, pair.first, pair.second));
    }
    matrix(i, j) = matrix(j, i) = pair.coefficient;
  }
  if (!correlations.empty()) POLYEST_RETURN_IF_ERROR(CheckPositiveDefinite(matrix, correlations));
  return matrix;
}

}  // namespace polyest::internal
