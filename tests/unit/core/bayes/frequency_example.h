#pragma once

// Gives the example of §3.4 as a cost on an expansion: mass and stiffness are normal, and one
// frequency is measured.

#include <cmath>

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"
#include "core/chaos/collocation_matrix.h"
#include "core/chaos/collocation_points.h"

namespace polyest::internal {

inline constexpr double kMeanMass = 200;
inline constexpr double kMassDeviation = 6.667;
inline constexpr double kStiffnessDeviation = 1052.8;
inline constexpr double kObservedFrequency = 6.098601;

inline double Frequency(const Vector& xi) {
  const double stiffness = kMeanMass * 4 * M_PI * M_PI + kStiffnessDeviation * xi[1];
  return std::sqrt(stiffness / (kMeanMass + kMassDeviation * xi[0]));
}

// Makes the cost with Hermite polynomials of order 8. Their error of ω near the minimum is below
// 10⁻⁷ rad/s.
inline Cost FrequencyCost(double noise, double regularization) {
  const Prior prior(
      {UncertainParameter::Normal("m", kMeanMass, kMassDeviation).value(),
       UncertainParameter::Normal("k", kMeanMass * 4 * M_PI * M_PI, kStiffnessDeviation).value()});
  const int order = 8;
  const auto basis = std::make_shared<const Basis>(prior.germs(), order);
  const Matrix points = CollocationPoints(PointSet::kGaussTensor, prior.germs(), order, 0).value();
  CollocationMatrix matrix = CollocationMatrix::Factor(*basis, points).value();
  Matrix values(points.rows(), 1);
  for (Eigen::Index q = 0; q < points.rows(); ++q) {
    values(q, 0) = Frequency(points.row(q).transpose());
  }
  Matrix coefficients(basis->size(), 1);
  Vector residual(1);
  matrix.Solve(values, coefficients, residual);
  const Vector reference = Vector::Zero(2);
  Vector phi_0(basis->size());
  basis->Evaluate(reference, phi_0);
  MismatchSums sums(basis->size());
  sums.Add(coefficients.col(0), kObservedFrequency - coefficients.col(0).dot(phi_0), noise * noise);
  return Cost(basis, Region::WholePrior(2), reference, sums, prior, regularization);
}

inline Minimum FrequencyMinimum(const Cost& cost) {
  MinimizationProblem problem;
  problem.function = [&cost](const Vector& eta, Vector* gradient) {
    if (gradient == nullptr) return cost.Evaluate(eta).total;
    return cost.EvaluateWithGradient(eta, *gradient).total;
  };
  problem.lower = Vector::Constant(2, -3);
  problem.upper = Vector::Constant(2, 3);
  problem.constraint.resize(0, 2);
  Matrix starts(2, 2);
  starts << 0, 0, 1.5, -1;
  return FindMinima(problem, starts, {}, {}).front();
}

}  // namespace polyest::internal
