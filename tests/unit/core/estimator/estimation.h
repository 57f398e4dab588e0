#pragma once

// Helps the tests of estimates: the oscillator of the paper's (26) with its closed form, and
// comparisons of whole estimates.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "polyest/catalogue.h"
#include "polyest/estimator.h"

namespace polyest::internal {

// Returns x(t) for v0 = 1 m/s: x = v0 sin(2πt)/2π.
inline double UnitResponse(double time_s) {
  return std::sin(2 * std::numbers::pi * time_s) / (2 * std::numbers::pi);
}

// Makes the problem of the paper's oscillator with v0 unknown and x measured.
inline Problem InitialVelocityProblem(UncertainParameter v0, double noise) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.uncertain = {std::move(v0)};
  problem.measured = {{"x", {.absolute = noise}}};
  problem.expansion.order = 3;
  return problem;
}

// Returns x at the given times for the given v0, with white noise.
inline Samples InitialVelocityRecord(const std::vector<double>& time_s, double v0, double noise,
                                     uint64_t seed = 1) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0, noise);
  Samples samples;
  samples.time_s = time_s;
  samples.columns = {{"x", {}, {}}};
  for (const double t : time_s) {
    samples.columns[0].value.push_back(v0 * UnitResponse(t) + normal(generator));
  }
  return samples;
}

inline std::unique_ptr<Estimator> MakeEstimator(const Problem& problem,
                                                EstimatorOptions options = {}) {
  return Estimator::Make(problem, std::move(options)).value();
}

inline Estimate EstimateOf(const Problem& problem, const Samples& samples) {
  const auto estimator = MakeEstimator(problem);
  EXPECT_TRUE(estimator->Append(samples).ok());
  const absl::Status status = estimator->Process();
  EXPECT_TRUE(status.ok()) << status;
  return estimator->CurrentEstimate().value();
}

// Returns the message of the diagnostic, or nothing.
inline std::string Message(const Estimate& estimate, DiagnosticCode code) {
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    if (diagnostic.code == code) return diagnostic.message;
  }
  return "";
}
inline bool Has(const Estimate& estimate, DiagnosticCode code) {
  return !Message(estimate, code).empty();
}

// Returns every number of an estimate in a fixed order.
inline std::vector<double> NumbersOf(const Estimate& estimate) {
  std::vector<double> all;
  for (const ParameterEstimate& p : estimate.parameters) {
    all.insert(all.end(),
               {p.map, p.std_dev, p.robust_std_dev, p.mean, p.lower95, p.upper95, p.prior_mean,
                p.prior_std_dev, p.contraction, static_cast<double>(p.verdict)});
  }
  all.insert(all.end(), estimate.covariance.data(),
             estimate.covariance.data() + estimate.covariance.size());
  all.insert(all.end(), {estimate.cost.mismatch, estimate.cost.prior, estimate.cost.total,
                         estimate.regularization, estimate.disagreement, estimate.time_s,
                         static_cast<double>(estimate.samples)});
  for (const ChannelEstimate& c : estimate.channels) {
    all.insert(all.end(), {static_cast<double>(c.samples), c.chi_squared, c.noise_std_dev});
  }
  for (const Direction& d : estimate.directions) {
    all.push_back(d.information);
    all.insert(all.end(), d.coefficients.begin(), d.coefficients.end());
  }
  for (const FilteredQuantity& one : estimate.filtered) {
    all.insert(all.end(), {one.mean, one.std_dev, one.lower95, one.upper95});
  }
  const ExpansionSummary& e = estimate.expansion;
  all.insert(all.end(), {static_cast<double>(e.order), static_cast<double>(e.terms),
                         static_cast<double>(e.points), e.residual_to_noise,
                         static_cast<double>(e.reexpansions), static_cast<double>(e.trajectories)});
  return all;
}

inline void ExpectFinite(const Estimate& estimate) {
  for (const double number : NumbersOf(estimate)) EXPECT_TRUE(std::isfinite(number));
}

inline void ExpectSame(const Estimate& a, const Estimate& b) {
  EXPECT_EQ(NumbersOf(a), NumbersOf(b));
  ASSERT_EQ(a.diagnostics.size(), b.diagnostics.size());
  for (size_t i = 0; i < a.diagnostics.size(); ++i) {
    EXPECT_EQ(a.diagnostics[i].message, b.diagnostics[i].message);
  }
}

}  // namespace polyest::internal
