#include "tests/testing/oscillator.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>

#include "polyest/catalogue.h"

namespace polyest::internal::testing {
namespace {

constexpr double kStiffness = 4 * std::numbers::pi * std::numbers::pi;  // N/m: 1 Hz
constexpr double kDamping = 0.2;                                        // N s/m
constexpr double kStiffnessSpread = 0.2;
constexpr double kDampingSpread = 0.5;

}  // namespace

double OscillatorDisplacement(double k, double c, double time_s) {
  // x = e^{−st} (cos ωt + (s/ω) sin ωt),  s = c/2m,  ω² = k/m − s²
  const double s = c / 2;
  const double omega = std::sqrt(k - s * s);
  return std::exp(-s * time_s) * (std::cos(omega * time_s) + s / omega * std::sin(omega * time_s));
}

Problem OscillatorProblem(int order, bool adaptive) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"x0", 1}};
  problem.uncertain = {*UncertainParameter::Uniform("k", kStiffness * (1 - kStiffnessSpread),
                                                    kStiffness * (1 + kStiffnessSpread)),
                       *UncertainParameter::Uniform("c", kDamping * (1 - kDampingSpread),
                                                    kDamping * (1 + kDampingSpread))};
  problem.measured = {{"x", {.absolute = kOscillatorNoise}}};
  problem.expansion.order = order;
  problem.expansion.adaptive = adaptive;
  return problem;
}

Samples OscillatorRecord(double duration_s, uint64_t seed, OscillatorTruth& truth) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> within(-0.9, 0.9);
  std::normal_distribution<double> noise(0, kOscillatorNoise);
  truth.k = kStiffness * (1 + kStiffnessSpread * within(generator));
  truth.c = kDamping * (1 + kDampingSpread * within(generator));
  Samples record;
  record.columns.push_back({"x", {}, {}});
  for (int i = 1; i <= std::lround(duration_s * kOscillatorRate); ++i) {
    const double time_s = i / kOscillatorRate;
    record.time_s.push_back(time_s);
    record.columns[0].value.push_back(OscillatorDisplacement(truth.k, truth.c, time_s) +
                                      noise(generator));
  }
  return record;
}

LeastSquares FitOscillator(const Samples& record, const OscillatorTruth& start) {
  Eigen::Vector2d theta(start.k, start.c);
  Eigen::Matrix2d normal;
  for (int iteration = 0; iteration < 20; ++iteration) {
    normal.setZero();
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
    for (size_t i = 0; i < record.rows(); ++i) {
      const double t = record.time_s[i];
      Eigen::Vector2d slope;
      for (int j = 0; j < 2; ++j) {
        constexpr double kStep = 1e-5;
        Eigen::Vector2d high = theta, low = theta;
        high[j] += kStep;
        low[j] -= kStep;
        slope[j] = (OscillatorDisplacement(high[0], high[1], t) -
                    OscillatorDisplacement(low[0], low[1], t)) /
                   (2 * kStep * kOscillatorNoise);
      }
      const double error =
          (record.columns[0].value[i] - OscillatorDisplacement(theta[0], theta[1], t)) /
          kOscillatorNoise;
      normal += slope * slope.transpose();
      gradient += slope * error;
    }
    theta += normal.ldlt().solve(gradient);
  }
  const Eigen::Matrix2d covariance = normal.inverse();
  return {theta[0], theta[1], std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1))};
}

}  // namespace polyest::internal::testing
