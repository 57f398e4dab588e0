#include "core/propagation/row_steps.h"

namespace polyest::internal {
namespace {

constexpr int kLast = RowSteps::kStages - 1;

constexpr std::array<double, RowSteps::kStages> kTimes = {0,       1.0 / 5, 3.0 / 10, 4.0 / 5,
                                                          8.0 / 9, 1,       1};
// The last row contains the b_i.
constexpr double kCoefficients[RowSteps::kStages][RowSteps::kStages] = {
    {},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
constexpr std::array<double, RowSteps::kStages> kErrors = {
    71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
constexpr std::array<double, RowSteps::kStages> kDense = {
    -12715105075.0 / 11282082432,  0,
    87487479700.0 / 32700410799,   -10690763975.0 / 1880347072,
    701980252875.0 / 199316789632, -1453857185.0 / 822651844,
    69997945.0 / 29380423};

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
  for (int i = 1; i <= kLast; ++i) {
    Eigen::ArrayXXd& x = i == kLast ? end_ : i == kLast - 1 ? near_end_ : stage_states_;
    for (Eigen::Index s = 0; s < states.cols(); ++s) {
      auto column = x.col(s);
      column = kCoefficients[i][0] * stages_[0].col(s);
      for (int j = 1; j < i; ++j) {
        if (kCoefficients[i][j] == 0) continue;
        column += kCoefficients[i][j] * stages_[static_cast<size_t>(j)].col(s);
      }
      column = states.col(s) + steps_s * column;
    }
    stage_times_s_ = times_s + kTimes[static_cast<size_t>(i)] * steps_s;
    system.Rates(stage_times_s_, x, stages_[static_cast<size_t>(i)]);
  }
}

double RowSteps::Error(Eigen::Index row, Eigen::Index state, double step_s) const {
  double sum = 0;
  for (size_t i = 0; i < kStages; ++i) sum += kErrors[i] * stages_[i](row, state);
  return step_s * sum;
}

// With B = Σ b_i k_i:
//   Σ w_i k_i = θ B + θ (1−θ) (k_1 − B) + θ² (1−θ) (2 B − k_1 − k_7) + θ² (1−θ)² Σ d_i k_i
std::array<double, RowSteps::kStages> RowSteps::Weights(double theta) {
  const double rest = 1 - theta;
  std::array<double, kStages> weights;
  for (size_t i = 0; i < kStages; ++i) {
    const double b = kCoefficients[kLast][i];
    const double first = i == 0 ? 1 : 0;
    const double last = i == kLast ? 1 : 0;
    weights[i] =
        theta * (b + rest * (first - b + theta * (2 * b - first - last + rest * kDense[i])));
  }
  return weights;
}

}  // namespace polyest::internal
