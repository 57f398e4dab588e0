#pragma once

// Provides a test problem with a known exact solution: the damped 1 Hz oscillator, m = 1 kg,
// x(0) = 1 m at rest, with k and c unknown and x measured.

#include "polyest/estimator.h"

namespace polyest::internal::testing {

inline constexpr double kOscillatorNoise = 0.01;  // m
inline constexpr double kOscillatorRate = 20;     // samples per second

// Returns x(t) of m ẍ + c ẋ + k x = 0 in closed form.
double OscillatorDisplacement(double k, double c, double time_s);

// Returns the problem. The priors are uniform: k within 20 % of (2π)² N/m and c within 50 % of
// 0.2 N s/m.
Problem OscillatorProblem(int order, bool adaptive = true);

struct OscillatorTruth {
  double k = 0;
  double c = 0;
};

// Draws the true values within 90 % of the prior's range and returns their record with white noise.
// Both depend on `duration_s` and `seed` alone.
Samples OscillatorRecord(double duration_s, uint64_t seed, OscillatorTruth& truth);

// Least-squares estimate of the closed form, by Gauss–Newton from the true values. An estimate with
// uniform priors must agree with it. The standard deviations are from the inverse of JᵀJ/σ².
struct LeastSquares {
  double k = 0;
  double c = 0;
  double k_std_dev = 0;
  double c_std_dev = 0;
};
LeastSquares FitOscillator(const Samples& record, const OscillatorTruth& start);

}  // namespace polyest::internal::testing
