#pragma once

// Propagates the half car at the practical limit of speed: by a Dormand–Prince method that is
// written by hand for this model, with eight trajectories in the lanes of SIMD registers. The steps
// between two samples (and so between kinks) are equal, and as many as the error of the worst lane
// requires. The code is not general: it knows the scales of the states.

#include <algorithm>
#include <array>
#include <cmath>

#include "core/common/types.h"
#include "tests/bench/half_car.h"

namespace polyest::internal::bench {

class SimdLanes {
 public:
  using State = std::array<Lane, HalfCar::kStates>;

  static void Propagate(double tolerance, const Matrix& parameters, int samples, Matrix& outputs) {
    for (Eigen::Index first = 0; first < parameters.rows(); first += kLanes) {
      SimdLanes lanes(parameters.middleRows<kLanes>(first));
      lanes.Read(first, 0, outputs);
      for (int sample = 1; sample < samples; ++sample) {
        lanes.Advance((sample - 1) * 0.01, tolerance);
        lanes.Read(first, sample, outputs);
      }
    }
  }

 private:
  explicit SimdLanes(const Matrix& parameters)
      : parameters_{parameters.col(0).array(), parameters.col(1).array()} {
    for (Lane& state : x_) state.setZero();
  }

  void Advance(double begin_s, double tolerance) {
    const State start = x_;
    for (;;) {
      const double step_s = 0.01 / steps_;
      double error = 0;
      for (int step = 0; step < steps_; ++step) {
        error = std::max(error, Step(begin_s + step * step_s, step_s));
      }
      const double growth = std::pow(error / tolerance, 0.2) / 0.9;
      const int used = steps_;
      steps_ = std::clamp(static_cast<int>(std::ceil(steps_ * growth)), 1, 100);
      if (error <= tolerance || used >= steps_) return;
      x_ = start;
    }
  }

  void Rates(double time_s, double middle_s, const State& x, State& rates) const {
    HalfCar::Derivatives(time_s, x, parameters_,
                         std::array<Lane, 2>{Lane::Constant(Road(0, time_s, middle_s)),
                                             Lane::Constant(Road(1, time_s, middle_s))},
                         rates);
  }

  // Returns x + h Σ a_j k_j.
  template <size_t kStages>
  State Moved(double h, const std::array<double, kStages>& a) const {
    State moved;
    for (int s = 0; s < HalfCar::kStates; ++s) {
      moved[s] = x_[s];
      for (size_t j = 0; j < kStages; ++j) moved[s] += (h * a[j]) * k_[j][s];
    }
    return moved;
  }

  // Makes one step. Returns the largest local error, relative to 0.05 m or 1 m/s.
  double Step(double t, double h) {
    const double middle = t + h / 2;
    Rates(t, middle, x_, k_[0]);
    Rates(t + h / 5, middle, Moved<1>(h, {1.0 / 5}), k_[1]);
    Rates(t + 3 * h / 10, middle, Moved<2>(h, {3.0 / 40, 9.0 / 40}), k_[2]);
    Rates(t + 4 * h / 5, middle, Moved<3>(h, {44.0 / 45, -56.0 / 15, 32.0 / 9}), k_[3]);
    Rates(t + 8 * h / 9, middle,
          Moved<4>(h, {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729}), k_[4]);
    Rates(t + h, middle,
          Moved<5>(h, {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656}),
          k_[5]);
    x_ = Moved<6>(h, {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84});
    Rates(t + h, middle, x_, k_[6]);
    Lane worst = Lane::Zero();
    for (int s = 0; s < HalfCar::kStates; ++s) {
      const Lane error = (71.0 / 57600) * k_[0][s] - (71.0 / 16695) * k_[2][s] +
                         (71.0 / 1920) * k_[3][s] - (17253.0 / 339200) * k_[4][s] +
                         (22.0 / 525) * k_[5][s] - (1.0 / 40) * k_[6][s];
      worst = worst.max((s < 4 ? 20 * h : h) * error.abs());
    }
    return worst.maxCoeff();
  }

  void Read(Eigen::Index first, int sample, Matrix& outputs) const {
    std::array<Lane, HalfCar::kOutputs> y;
    HalfCar::Outputs(0, x_, parameters_, std::array<Lane, 2>{}, y);
    for (int j = 0; j < HalfCar::kOutputs; ++j) {
      outputs.col(sample * HalfCar::kOutputs + j).segment<kLanes>(first) = y[j].matrix();
    }
  }

  std::array<Lane, HalfCar::kParameters> parameters_;
  State x_;
  std::array<State, 7> k_;
  int steps_ = 4;
};

}  // namespace polyest::internal::bench
