#pragma once

// log Σ e^x without over- or underflow: with the greatest x taken out, log Σ e^x = max + log Σ
// e^(x − max). The forms differ in where the terms come from, not in what they compute.

#include <algorithm>
#include <cmath>

#include "core/common/types.h"

namespace polyest::internal {

// Returns log(Σ_i e^{term(i)} ÷ divisor) for i = 0 … count − 1, count ≥ 1: with the divisor `count`
// that of the mean. Calls `term` twice for each i and stores nothing.
template <class Term>
double LogSumExp(Eigen::Index count, const Term& term, double divisor = 1) {
  double largest = -kInfinity;
  for (Eigen::Index i = 0; i < count; ++i) largest = std::max(largest, term(i));
  double sum = 0;
  for (Eigen::Index i = 0; i < count; ++i) sum += std::exp(term(i) - largest);
  return largest + std::log(sum / divisor);
}

// Returns log Σ_j e^{terms(i, j)} for each row i.
Vector LogSumExpOfRows(const Matrix& terms);

}  // namespace polyest::internal
