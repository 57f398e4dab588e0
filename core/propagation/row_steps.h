#pragma once

// Steps of the method of Dormand and Prince of order 5 (dormand_prince_tables.h) for rows whose
// steps begin at different times and have different lengths:
//
//   k_i = f(t + c_i h, x + h Σ_{j<i} a_ij k_j),  x(t + h) ≈ x + h Σ b_i k_i,  error h Σ e_i k_i
//
// and in between, with θ from 0 to 1, x(t + θ h) ≈ x + h Σ w_i(θ) k_i of order 4 (E. Hairer, S. P.
// Nørsett, G. Wanner, Solving Ordinary Differential Equations I, II.6).

#include <array>

#include "core/common/types.h"

namespace polyest::internal {

// The right-hand side of rows at times of their own.
class RowSystem {
 public:
  virtual ~RowSystem() = default;
  // Writes dx/dt of each row: rows × states.
  virtual void Rates(const Eigen::ArrayXd& times_s, const Eigen::ArrayXXd& states,
                     Eigen::ArrayXXd& rates) = 0;
};

class RowSteps {
 public:
  static constexpr int kStages = 7;
  using Stages = std::array<Eigen::ArrayXXd, kStages>;

  RowSteps(Eigen::Index rows, Eigen::Index states);

  // Takes a step of each row. The first stage must be f(times, states).
  void Take(RowSystem& system, const Eigen::ArrayXd& times_s, const Eigen::ArrayXd& steps_s,
            const Eigen::ArrayXXd& states);

  Eigen::ArrayXXd& first_stage() { return stages_[0]; }
  const Stages& stages() const { return stages_; }
  // Returns the states at the ends of the steps, at which the last stage was evaluated.
  const Eigen::ArrayXXd& ends() const { return end_; }
  // Returns the states at which the last stage but one was evaluated, also at the ends' times.
  const Eigen::ArrayXXd& near_ends() const { return near_end_; }
  // Returns the estimated error of a state at the end of a row's step.
  double Error(Eigen::Index row, Eigen::Index state, double step_s) const;

  // Returns w_i(θ).
  static std::array<double, kStages> Weights(double theta);

 private:
  Stages stages_;
  Eigen::ArrayXXd stage_states_;
  Eigen::ArrayXXd near_end_;
  Eigen::ArrayXXd end_;
  Eigen::ArrayXd stage_times_s_;
};

}  // namespace polyest::internal
