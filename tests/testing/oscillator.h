#pragma once

// The damped 1 Hz oscillator, m = 1 kg, x(0) = 1 m at rest, k and c unknown, x measured: a problem
// whose exact answer is at hand.

#include "polyest/estimator.h"

namespace polyest::internal::testing {

inline constexpr double kOscillatorNoise = 0.01;  // m
inline constexpr double kOscillatorRate = 20;     // samples a second

// x(t) of m ẍ + c ẋ + k x = 0 in closed form.
double OscillatorDisplacement(double k, double c, double time_s);

// k ± 20 % and c ± 50 %, both uniform, about (2π)² N/m and 0.2 N s/m.
Problem OscillatorProblem(int order, bool adaptive = true);

struct OscillatorTruth {
  double k = 0;
  double c = 0;
};

// Truth drawn within 90 % of the prior, white noise added; a function of the seed alone.
Samples OscillatorRecord(double duration_s, uint64_t seed, OscillatorTruth& truth);

// Least squares on the closed form by Gauss–Newton from the truth: what an estimate with uniform
// priors must find. Standard deviations from the inverse of JᵀJ/σ².
struct LeastSquares {
  double k = 0;
  double c = 0;
  double k_std_dev = 0;
  double c_std_dev = 0;
};
LeastSquares FitOscillator(const Samples& record, const OscillatorTruth& start);

}  // namespace polyest::internal::testing
