#pragma once

// Problems whose posterior is in several pieces, with the closed form of their model.

#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "core/model/equations/equation_model.h"
#include "polyest/estimator.h"

namespace polyest::internal::mixture {

inline constexpr double kNoise = 0.1;

inline Problem TextProblem(const char* output, std::vector<UncertainParameter> uncertain,
                           int order) {
  Problem problem;
  EquationSpecification equations;
  equations.outputs = {{"y", output}};
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = std::move(uncertain);
  problem.measured = {{"y", {.absolute = kNoise}}};
  problem.expansion.order = order;
  return problem;
}

inline Samples Record(const std::function<double(double)>& y, double step_s, int count,
                      uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0, kNoise);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int i = 1; i <= count; ++i) {
    samples.time_s.push_back(i * step_s);
    samples.columns[0].value.push_back(y(i * step_s) + normal(generator));
  }
  return samples;
}

using Output = std::function<double(const Vector& theta, double t)>;
using LogPrior = std::function<double(const Vector& theta)>;

// Returns −log density of θ, up to a constant.
inline double ExactCost(const Samples& samples, const Output& y, const LogPrior& prior,
                        const Vector& theta) {
  double sum = -prior(theta);
  for (size_t i = 0; i < samples.rows(); ++i) {
    const double e = samples.columns[0].value[i] - y(theta, samples.time_s[i]);
    sum += 0.5 * e * e / (kNoise * kNoise);
  }
  return sum;
}

struct Case {
  const char* name;
  Problem problem;
  Samples samples;
  Output output;
  LogPrior log_prior;
};

inline void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

inline double LogNormal(double x, double mean, double std_dev) {
  return -0.5 * std::pow((x - mean) / std_dev, 2);
}

// Makes a problem whose frequency tells a² and not its sign; the prior favours one. No single
// polynomial over both signs follows a phase that grows with time.
inline Case OfASign(const char* name, double prior_mean, int rows) {
  return {name,
          TextProblem("cos((5 + a^2) * t)",
                      {UncertainParameter::Normal("a", prior_mean, 0.7).value()}, 4),
          Record([](double t) { return std::cos(5.64 * t); }, 0.05, rows, 3),
          [](const Vector& theta, double t) { return std::cos((5 + theta[0] * theta[0]) * t); },
          [=](const Vector& theta) { return LogNormal(theta[0], prior_mean, 0.7); }};
}

inline Case OfASignBesideADamping() {
  return {"besideADamping",
          TextProblem("exp(-c * t) * cos((5 + a^2) * t)",
                      {UncertainParameter::Normal("a", -0.2, 0.7).value(),
                       UncertainParameter::Normal("c", 0.12, 0.03).value()},
                      4),
          Record([](double t) { return std::exp(-0.1 * t) * std::cos(5.64 * t); }, 0.05, 300, 4),
          [](const Vector& theta, double t) {
            return std::exp(-theta[1] * t) * std::cos((5 + theta[0] * theta[0]) * t);
          },
          [](const Vector& theta) {
            return LogNormal(theta[0], -0.2, 0.7) + LogNormal(theta[1], 0.12, 0.03);
          }};
}

}  // namespace polyest::internal::mixture
