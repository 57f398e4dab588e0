#include "core/bayes/log_sum_exp.h"

namespace polyest::internal {

Vector LogSumExpOfRows(const Matrix& terms) {
  const Vector largest = terms.rowwise().maxCoeff();
  return largest.array() + (terms.colwise() - largest).array().exp().rowwise().sum().log();
}

}  // namespace polyest::internal
