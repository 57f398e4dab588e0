#pragma once

// Sums Σ_j c_j k_j over the stages of a Runge–Kutta method for a block of trajectories. They are
// unrolled by templates, kLanes numbers at a time: each number of each stage is read once, and
// coefficients that are 0 cost nothing.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <iterator>
#include <utility>

#include "core/common/types.h"
#include "core/model/lane.h"
#include "core/propagation/dormand_prince_tables.h"

namespace polyest::internal {

using Stages = std::array<Eigen::ArrayXXd, DormandPrince8::kAllStages>;

// Rows of coefficients as types, so that sums over stages are unrolled without the zeros.
template <class Method, int kStage>
struct StateRow {
  static constexpr int kCount = kStage;
  static constexpr double At(size_t j) { return Method::kA[kStage][j]; }
};
template <const auto& kCoefficients>
struct ErrorRow {
  static constexpr int kCount = std::size(kCoefficients);
  static constexpr double At(size_t j) { return kCoefficients[j]; }
};
template <const auto& kRows, int kRow>
struct InterpolantRow {
  static constexpr int kCount = std::size(kRows[kRow]);
  static constexpr double At(size_t j) { return kRows[kRow][j]; }
};

// Returns the stages of a row whose coefficients are not 0.
template <class Row>
constexpr auto NonzeroStages() {
  constexpr auto is_nonzero = [](size_t j) { return Row::At(j) != 0; };
  constexpr size_t count = [&] {
    size_t nonzero = 0;
    for (size_t j = 0; j < Row::kCount; ++j) nonzero += is_nonzero(j) ? 1 : 0;
    return nonzero;
  }();
  std::array<size_t, count> stages{};
  for (size_t j = 0, k = 0; j < Row::kCount; ++j) {
    if (is_nonzero(j)) stages[k++] = j;
  }
  return stages;
}

// Returns Σ_j c_j k_j of the eight numbers from `i` on.
template <class Row>
Lane Sum(const Stages& stages, Eigen::Index i) {
  static constexpr auto kNonzero = NonzeroStages<Row>();
  return [&]<size_t... k>(std::index_sequence<k...>)->Lane {
    return (... + (Row::At(kNonzero[k]) * Lane::Map(stages[kNonzero[k]].data() + i)));
  }
  (std::make_index_sequence<kNonzero.size()>());
}

// Writes x + h Σ_j c_j k_j.
template <class Row>
void AddStages(const Eigen::ArrayXXd& x, double step_s, const Stages& stages,
               Eigen::ArrayXXd& sums) {
  for (Eigen::Index i = 0; i < x.size(); i += kLanes) {
    Lane::Map(sums.data() + i) = Lane::Map(x.data() + i) + step_s * Sum<Row>(stages, i);
  }
}

}  // namespace polyest::internal
