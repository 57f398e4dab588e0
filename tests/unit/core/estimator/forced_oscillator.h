#pragma once

// An oscillator that white force noise drives, its records, and the exact likelihood of its
// parameters: the Kalman filter's in dense matrices, with the same discretization of the process
// noise as the estimator's.

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {

inline constexpr double kStepS = 0.05;
inline constexpr double kSigma = 0.005;
inline constexpr double kTrueK = 40, kTrueC = 0.4, kTrueQ = 0.02;

inline Problem ForcedOscillator() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"x0", 1}, {"v0", 0}};
  problem.uncertain = {UncertainParameter::Uniform("k", 32, 48).value(),
                       UncertainParameter::Uniform("c", 0.1, 1).value()};
  problem.measured = {{"x", {.absolute = kSigma}}};
  return problem;
}

inline Problem WithUnknownNoise() {
  Problem problem = ForcedOscillator();
  problem.process_noise = {{.state = "v", .unknown = true, .lower = 1e-4, .upper = 1}};
  return problem;
}

struct Flow {
  Eigen::Matrix2d whole, half;
  Eigen::Vector2d force;  // what a constant force of 1 N does in an interval
};

inline Flow FlowOf(double k, double c) {
  Eigen::Matrix2d A;
  A << 0, 1, -k, -c;
  const Eigen::Matrix2d whole = (A * kStepS).exp();
  const Eigen::Vector2d force =
      A.inverse() * (whole - Eigen::Matrix2d::Identity()) * Eigen::Vector2d(0, 1);
  return {whole, (A * kStepS / 2).exp(), force};
}

inline Eigen::Matrix2d NoiseOf(const Flow& flow, double q) {
  Eigen::Matrix2d Q = Eigen::Matrix2d::Zero();
  Q(1, 1) = q;
  return kStepS / 6 *
         (flow.whole * Q * flow.whole.transpose() + 4 * flow.half * Q * flow.half.transpose() + Q);
}

// The force in the interval that ends with a row: it holds from the row before, and the first one
// from the beginning. 0 without a column of forces.
inline double ForceBefore(const Samples& samples, size_t row) {
  if (samples.columns.size() < 2) return 0;
  return samples.columns[1].value[row == 0 ? 0 : row - 1];
}

// Returns samples of the oscillator with noise of the given spectral density.
inline Samples Measure(int rows, double q, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const Flow flow = FlowOf(kTrueK, kTrueC);
  const Eigen::Matrix2d root = Eigen::LLT<Eigen::Matrix2d>(NoiseOf(flow, 1)).matrixL();
  Eigen::Vector2d x(1, 0);
  Samples samples;
  samples.columns = {{"x", {}, {}}};
  for (int i = 1; i <= rows; ++i) {
    const Eigen::Vector2d shock(normal(random), normal(random));
    x = flow.whole * x + std::sqrt(q) * (root * shock);
    samples.time_s.push_back(i * kStepS);
    samples.columns[0].value.push_back(x[0] + kSigma * normal(random));
  }
  return samples;
}

// −log of the likelihood of (k, c, log q), up to a constant.
inline double ExactCost(const Samples& samples, const Eigen::Vector3d& at) {
  const Flow flow = FlowOf(at[0], at[1]);
  const Eigen::Matrix2d Q = NoiseOf(flow, std::exp(at[2]));
  Eigen::Vector2d m(1, 0);
  Eigen::Matrix2d P = Eigen::Matrix2d::Zero();
  double cost = 0;
  for (size_t row = 0; row < samples.rows(); ++row) {
    const double z = samples.columns[0].value[row];
    m = flow.whole * m + ForceBefore(samples, row) * flow.force;
    P = flow.whole * P * flow.whole.transpose() + Q;
    if (!samples.columns[0].missing.empty() && samples.columns[0].missing[row]) continue;
    const double nu = z - m[0], S = P(0, 0) + kSigma * kSigma;
    const Eigen::Vector2d gain = P.col(0) / S;
    cost += 0.5 * (nu * nu / S + std::log(S / (kSigma * kSigma)));
    m += gain * nu;
    P -= S * gain * gain.transpose();
  }
  return cost;
}

struct Maximum {
  Vector at, std_dev;
  double cost = 0;
  double log_volume = 0;  // ½ log of the covariance's determinant
};

// Minimizes by Newton's method with central differences.
inline Maximum Minimize(const std::function<double(const Vector&)>& cost, Vector at,
                        const Vector& step) {
  const Eigen::Index n = at.size();
  Matrix hessian(n, n);
  for (int iteration = 0; iteration < 30; ++iteration) {
    Vector gradient(n);
    const auto near = [&](const Vector& by) { return cost(at + step.cwiseProduct(by)); };
    for (Eigen::Index i = 0; i < n; ++i) {
      const Vector a = Vector::Unit(n, i);
      gradient[i] = (near(a) - near(-a)) / (2 * step[i]);
      for (Eigen::Index j = 0; j < n; ++j) {
        const Vector b = Vector::Unit(n, j);
        hessian(i, j) =
            (near(a + b) - near(a - b) - near(b - a) + near(-a - b)) / (4 * step[i] * step[j]);
      }
    }
    const Vector move = hessian.inverse() * gradient;
    at -= move;
    if (move.norm() < 1e-6) break;
  }
  return {at, hessian.inverse().diagonal().cwiseSqrt(), cost(at),
          -0.5 * std::log(hessian.determinant())};
}

}  // namespace polyest::internal
