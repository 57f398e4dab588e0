#pragma once

// Makes records, and estimators that keep their snapshots of them.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/estimator/snapshot.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {

inline constexpr double kStep = 0.05;
inline constexpr int kInterval = 32;

// Returns equally spaced rows of several runs from t = 0, of an output with white noise.
inline Samples Record(const std::string& output, const std::function<double(double t)>& y,
                      double noise, int rows, int runs = 1) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal(0, noise);
  Samples samples;
  samples.columns = {{output, {}, {}}};
  for (int run = 0; run < runs; ++run) {
    for (int k = 0; k < rows; ++k) {
      samples.time_s.push_back(kStep * k);
      samples.run.push_back(run);
      samples.columns[0].value.push_back(y(kStep * k) + normal(generator));
    }
  }
  return samples;
}

// Holds an estimator and its last snapshot.
struct Session {
  explicit Session(const Problem& problem, int threads = 1) {
    EstimatorOptions options;
    options.threads = threads;
    options.snapshot = [this](EstimatorSnapshot snapshot) {
      rows.push_back(snapshot.rows);
      last = std::move(snapshot);
    };
    estimator = MakeEstimator(problem, options);
  }
  Session(const Session&) = delete;

  void Take(const Samples& samples) {
    const absl::Status appended = estimator->Append(samples);
    ASSERT_TRUE(appended.ok()) << appended;
    const absl::Status status = estimator->Process();
    ASSERT_TRUE(status.ok()) << status;
  }
  Estimate Current() const { return estimator->CurrentEstimate().value(); }

  std::unique_ptr<Estimator> estimator;
  EstimatorSnapshot last;
  std::vector<int64_t> rows;  // of all snapshots
};

// Makes m ẍ + c ẋ + k x = force with k and x0 uncertain and x measured.
inline Problem OscillatorProblem(double noise = 0.02) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"c", 0.1}};
  problem.uncertain = {UncertainParameter::Uniform("k", 8, 12).value(),
                       UncertainParameter::Normal("x0", 1, 0.2).value()};
  problem.measured = {{"x", {.absolute = noise}}};
  problem.expansion.order = 3;
  return problem;
}

inline double Displacement(double t) {
  return 1.1 * std::exp(-0.05 * t) * std::cos(std::sqrt(9.7 - 0.0025) * t);
}

inline Samples OscillatorRecord(int rows = 240, int runs = 1) {
  return Record("x", Displacement, 0.02, rows, runs);
}

}  // namespace polyest::internal
