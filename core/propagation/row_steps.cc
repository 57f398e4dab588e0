#include "core/propagation/row_steps.h"

#include "core/propagation/dormand_prince_tables.h"

namespace polyest::internal {
namespace {

constexpr size_t kLast = DormandPrince5::kStages;
// The d_i of the interpolant, which are the coefficients of its highest power.
constexpr const auto& kDense = DormandPrince5::kP.back();

}  // namespace

RowSteps::RowSteps(Eigen::Index rows, Eigen::Index states)
    : stage_states_(rows, states),
      near_end_(rows, states),
      end_(rows, states),
      stage_times_s_(rows) {
  stages_.fill(Eigen::ArrayXXd::Zero(rows, states));
}

void RowSteps::Take(RowSystem& system, const Eigen::ArrayXd& times_s, const Eigen::ArrayXd& steps_s,
                    const Eigen::ArrayXXd& states) {
  for (size_t i = 1; i <= kLast; ++i) {
    Eigen::ArrayXXd& x = i == kLast ? end_ : i == kLast - 1 ? near_end_ : stage_states_;
    for (Eigen::Index s = 0; s < states.cols(); ++s) {
      auto column = x.col(s);
      column = DormandPrince5::kA[i][0] * stages_[0].col(s);
      for (size_t j = 1; j < i; ++j) {
        if (DormandPrince5::kA[i][j] != 0) column += DormandPrince5::kA[i][j] * stages_[j].col(s);
      }
      column = states.col(s) + steps_s * column;
    }
    stage_times_s_ = times_s + DormandPrince5::kC[i] * steps_s;
    system.Rates(stage_times_s_, x, stages_[i]);
  }
}

double RowSteps::Error(Eigen::Index row, Eigen::Index state, double step_s) const {
  double sum = 0;
  for (size_t i = 0; i < kStages; ++i) sum += DormandPrince5::kE[i] * stages_[i](row, state);
  return step_s * sum;
}

// With B = Σ b_i k_i:
//   Σ w_i k_i = θ B + θ (1−θ) (k_1 − B) + θ² (1−θ) (2 B − k_1 − k_7) + θ² (1−θ)² Σ d_i k_i
std::array<double, RowSteps::kStages> RowSteps::Weights(double theta) {
  const double rest = 1 - theta;
  std::array<double, kStages> weights;
  for (size_t i = 0; i < kStages; ++i) {
    const double b = DormandPrince5::kA[kLast][i];
    const double first = i == 0 ? 1 : 0;
    const double last = i == kLast ? 1 : 0;
    weights[i] =
        theta * (b + rest * (first - b + theta * (2 * b - first - last + rest * kDense[i])));
  }
  return weights;
}

}  // namespace polyest::internal
