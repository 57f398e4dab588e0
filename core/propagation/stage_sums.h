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

// The sum Σ_j c_j k_j over the stages. It has their addresses, which the compiler would otherwise
// load again after each number that is stored.
template <class Row>
class StageSum {
 public:
  explicit StageSum(const Stages& stages) {
    for (size_t k = 0; k < kNonzero.size(); ++k) stages_[k] = stages[kNonzero[k]].data();
  }

  // Returns the kLanes numbers of the sum from `i` on.
  Lane At(Eigen::Index i) const { return At(i, std::make_index_sequence<kNonzero.size()>()); }

 private:
  static constexpr auto kNonzero = NonzeroStages<Row>();

  template <size_t... k>
  Lane At(Eigen::Index i, std::index_sequence<k...>) const {
    return (... + (Row::At(kNonzero[k]) * Lane::Map(stages_[k] + i)));
  }

  std::array<const double*, kNonzero.size()> stages_;
};

// Writes x + h Σ_j c_j k_j.
template <class Row>
void AddStages(const Eigen::ArrayXXd& x, double step_s, const Stages& stages,
               Eigen::ArrayXXd& sums) {
  const StageSum<Row> sum(stages);
  const double* const begin = x.data();
  double* const end = sums.data();
  const Eigen::Index size = x.size();
  for (Eigen::Index i = 0; i < size; i += kLanes) {
    Lane::Map(end + i) = Lane::Map(begin + i) + step_s * sum.At(i);
  }
}

}  // namespace polyest::internal
