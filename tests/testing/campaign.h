#pragma once

// A campaign of many short runs of a damped oscillator, ẍ + c ẋ + k x = 0 with x(0) = 0, in which
// the velocity at release differs from run to run. The oracle is Gauss–Newton on all parameters at
// once, by dense linear algebra: x is linear in the velocities, so that each run's is a 1 × 1
// block.

#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

#include "core/common/linear_algebra.h"
#include "core/model/equations/equation_model.h"
#include "polyest/estimator.h"

namespace polyest::internal {

struct Campaign {
  static constexpr double kTrueStiffness = 38.2, kTrueDamping = 0.9;
  static constexpr double kNoise = 0.01;
  static constexpr int kRowsPerRun = 24;
  static constexpr double kStep = 0.05;

  static Problem MakeProblem() {
    EquationSpecification equations;
    equations.states = {{"x", "v"}, {"v", "-k * x - c * v"}};
    equations.outputs = {{"y", "x"}};
    equations.parameters = {{"x_0", 0}};
    Problem problem;
    problem.model = MakeEquationModel(equations).value();
    UncertainParameter release = UncertainParameter::Normal("v_0", 1, 0.5).value();
    release.per_run = true;
    problem.uncertain = {UncertainParameter::Normal("k", 40, 4).value(), std::move(release),
                         UncertainParameter::Normal("c", 1, 0.4).value()};
    problem.measured = {{"y", {.absolute = kNoise}}};
    return problem;
  }

  static Samples MakeRuns(int runs, double noise = kNoise, int first_run = 0) {
    Samples samples;
    samples.columns = {{"y", {}, {}}};
    for (int run = first_run; run < first_run + runs; ++run) {
      std::mt19937_64 generator(static_cast<uint64_t>(run) + 1);
      std::normal_distribution<double> normal;
      const double velocity = 1 + 0.5 * normal(generator);
      for (int i = 1; i <= kRowsPerRun; ++i) {
        samples.run.push_back(run);
        samples.time_s.push_back(kStep * i);
        samples.columns[0].value.push_back(velocity *
                                               Response(kTrueStiffness, kTrueDamping, kStep * i) +
                                           noise * normal(generator));
      }
    }
    return samples;
  }

  // x for a unit velocity.
  static double Response(double stiffness, double damping, double time_s) {
    const double omega = std::sqrt(stiffness - damping * damping / 4);
    return std::exp(-damping * time_s / 2) * std::sin(omega * time_s) / omega;
  }
};

struct CampaignOracle {
  Vector mode{{0, 0}};  // k, c
  Matrix covariance;
  double last_velocity = 0, last_deviation = 0;  // of the last run
};

// Returns the posterior of k, c and the last run's velocity.
inline CampaignOracle OracleOf(const Samples& samples, double noise = Campaign::kNoise) {
  constexpr double kVelocityInformation = 1 / 0.25;
  const Vector prior_mean{{40, 1}};
  const Matrix prior_information = Vector{{1.0 / 16, 1 / 0.16}}.asDiagonal();
  CampaignOracle oracle;
  oracle.mode = prior_mean;
  Vector response(Campaign::kRowsPerRun);
  Matrix slope(Campaign::kRowsPerRun, 2);
  for (int iteration = 0; iteration < 30; ++iteration) {
    for (int i = 0; i < Campaign::kRowsPerRun; ++i) {
      const double t = Campaign::kStep * (i + 1), k = oracle.mode[0], c = oracle.mode[1];
      constexpr double kDelta = 1e-5;
      response[i] = Campaign::Response(k, c, t);
      slope(i, 0) = (Campaign::Response(k + kDelta, c, t) - Campaign::Response(k - kDelta, c, t)) /
                    2 / kDelta;
      slope(i, 1) = (Campaign::Response(k, c + kDelta, t) - Campaign::Response(k, c - kDelta, t)) /
                    2 / kDelta;
    }
    Matrix information = prior_information;
    Vector right = prior_information * (prior_mean - oracle.mode);
    double own = 0;
    Vector follows(2);
    for (size_t first = 0; first < samples.rows(); first += Campaign::kRowsPerRun) {
      const Eigen::Map<const Vector> z(samples.columns[0].value.data() + first,
                                       Campaign::kRowsPerRun);
      // The velocity at its minimum for these k and c, then a step of k and c in which it follows.
      own = response.squaredNorm() / noise / noise + kVelocityInformation;
      const double velocity = (response.dot(z) / noise / noise + kVelocityInformation) / own;
      const Vector residual = z - velocity * response;
      const Matrix by_shared = velocity * slope;
      const Vector both = by_shared.transpose() * response / noise / noise;
      information +=
          by_shared.transpose() * by_shared / noise / noise - both * both.transpose() / own;
      const double by_own =
          response.dot(residual) / noise / noise + kVelocityInformation * (1 - velocity);
      right += by_shared.transpose() * residual / noise / noise - both * by_own / own;
      // ½ ∂ log H_vv
      right -= slope.transpose() * response / noise / noise / own;
      oracle.last_velocity = velocity;
      follows = both / own;
    }
    oracle.covariance = Inverse(information);
    oracle.last_deviation = std::sqrt(1 / own + follows.dot(oracle.covariance * follows));
    oracle.mode += oracle.covariance * right;
  }
  return oracle;
}

}  // namespace polyest::internal
