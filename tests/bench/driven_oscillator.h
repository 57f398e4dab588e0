#pragma once

// Simulates an endless stream: a nonlinear oscillator of 1 kg that a force of two tones drives,
//   x″ = −k x − c x′ − d x³ + 4 sin 5.1t + 3 sin 8.7t,
// measured a thousand times per second with noise. Its stiffness may wander as a random walk.

#include <cmath>
#include <cstdint>
#include <random>

#include "polyest/samples.h"

namespace polyest::internal {

// The oscillator by the classical Runge–Kutta method.
class DrivenOscillator {
 public:
  static constexpr double kStiffness = 41.3, kDamping = 0.83, kCubic = 20;  // N/m, N s/m, N/m³
  static constexpr double kNoise = 0.01;                                    // m
  static constexpr double kStepS = 1e-3;
  static constexpr int kBatch = 100;  // rows

  // `drift`: the standard deviation of the stiffness' walk in a second, N/m.
  explicit DrivenOscillator(double drift = 0) : drift_(drift) {}

  // Returns the next batch.
  Samples Next() {
    Samples samples;
    samples.columns = {{"x", {}, {}}};
    for (int i = 0; i < kBatch; ++i) {
      Step();
      samples.time_s.push_back(kStepS * static_cast<double>(rows_));
      samples.columns[0].value.push_back(x_ + kNoise * normal_(random_));
    }
    return samples;
  }

  // The stiffness at the end of the last batch, N/m.
  double stiffness() const { return stiffness_; }

 private:
  double Acceleration(double t, double x, double v) const {
    const double force = 4 * std::sin(5.1 * t) + 3 * std::sin(8.7 * t);
    return -stiffness_ * x - kDamping * v - kCubic * x * x * x + force;
  }
  void Step() {
    const double t = kStepS * static_cast<double>(rows_), h = kStepS;
    const double a1 = Acceleration(t, x_, v_), v2 = v_ + h / 2 * a1;
    const double a2 = Acceleration(t + h / 2, x_ + h / 2 * v_, v2), v3 = v_ + h / 2 * a2;
    const double a3 = Acceleration(t + h / 2, x_ + h / 2 * v2, v3), v4 = v_ + h * a3;
    const double a4 = Acceleration(t + h, x_ + h * v3, v4);
    x_ += h / 6 * (v_ + 2 * v2 + 2 * v3 + v4);
    v_ += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    if (drift_ > 0) stiffness_ += drift_ * std::sqrt(h) * normal_(random_);
    ++rows_;
  }

  double x_ = 0, v_ = 0;
  double stiffness_ = kStiffness;
  const double drift_;
  int64_t rows_ = 0;
  std::mt19937_64 random_{3};
  std::normal_distribution<double> normal_;
};

}  // namespace polyest::internal
