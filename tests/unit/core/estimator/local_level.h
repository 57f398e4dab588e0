#pragma once

// A measured number that walks at random (the local level model), and its exact Kalman filter, with
// the number's value at the beginning among its states.

#include <cmath>
#include <memory>
#include <random>

#include "polyest/equation_model.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {

inline constexpr double kLevelStepS = 0.1;
inline constexpr double kLevelSigma = 0.2;
inline constexpr double kRate = 0.3;
inline constexpr double kPriorMean = 5, kPriorDeviation = 2;

// Returns a model whose output is its parameter a; its state stays 0.
inline std::shared_ptr<const Model> Level() {
  return MakeEquationModel({.states = {{"z", "0"}},
                            .outputs = {{"y", "z + a"}},
                            .parameters = {{"a", 1}},
                            .units = {{"a", "N"}}})
      .value();
}

inline Problem DriftingLevel() {
  Problem problem;
  problem.model = Level();
  problem.uncertain = {UncertainParameter::Normal("a", kPriorMean, kPriorDeviation).value()};
  problem.uncertain[0].drift = RandomWalk{.std_dev_per_sqrt_s = kRate};
  problem.measured = {{"y", {.absolute = kLevelSigma}}};
  return problem;
}

inline Problem WithUnknownRate() {
  Problem problem = DriftingLevel();
  problem.uncertain[0].drift = RandomWalk{.unknown = true, .lower = 0.01, .upper = 3};
  return problem;
}

inline Samples Walk(int rows, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  double a = 6;
  for (int i = 1; i <= rows; ++i) {
    a += kRate * std::sqrt(kLevelStepS) * normal(random);
    samples.time_s.push_back(i * kLevelStepS);
    samples.columns[0].value.push_back(a + kLevelSigma * normal(random));
  }
  return samples;
}

struct LocalLevel {
  double mean = kPriorMean, variance = kPriorDeviation * kPriorDeviation;  // now
  double log_likelihood = 0;
};

// Takes the first `rows` rows.
inline LocalLevel ExactFilter(const Samples& samples, double rate, size_t rows,
                              double sigma = kLevelSigma) {
  LocalLevel level;
  for (size_t i = 0; i < rows; ++i) {
    const double z = samples.columns[0].value[i];
    level.variance += rate * rate * kLevelStepS;
    const double S = level.variance + sigma * sigma, nu = z - level.mean;
    level.log_likelihood -= 0.5 * (nu * nu / S + std::log(S));
    level.mean += level.variance / S * nu;
    level.variance -= level.variance * level.variance / S;
  }
  return level;
}

inline LocalLevel ExactFilter(const Samples& samples, double rate) {
  return ExactFilter(samples, rate, samples.rows());
}

}  // namespace polyest::internal
