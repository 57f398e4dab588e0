#pragma once

// Makes costs whose outputs are polynomials, which order 2 represents exactly.

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "core/bayes/cost.h"
#include "core/chaos/collocation_matrix.h"
#include "core/chaos/collocation_points.h"

namespace polyest::internal {

struct Measurement {
  std::function<double(const Vector& xi)> output;  // a polynomial of degree ≤ 2
  double z = 0;
  double noise = 0;
};

// Returns J = ½ Σ ((z − y(ξ))/σ)² + J_apriori, exact because order 2 represents the outputs.
// Outside of the element it is +∞.
inline Cost CostOf(const Prior& prior, const std::vector<Measurement>& measurements,
                   Element element = Element()) {
  const auto basis = std::make_shared<const Basis>(prior.germs(), 2);
  const Matrix points = CollocationPoints(PointSet::kGaussTensor, prior.germs(), 2, 0).value();
  CollocationMatrix matrix = CollocationMatrix::Factor(*basis, points).value();
  const Vector reference = Vector::Zero(prior.dimension());
  Vector phi_0(basis->size());
  basis->Evaluate(reference, phi_0);
  MismatchSums sums(basis->size());
  for (const Measurement& measurement : measurements) {
    Matrix values(points.rows(), 1);
    for (Eigen::Index q = 0; q < points.rows(); ++q) {
      values(q, 0) = measurement.output(points.row(q).transpose());
    }
    Matrix coefficients(basis->size(), 1);
    Vector residual(1);
    matrix.Solve(values, coefficients, residual);
    const double variance = measurement.noise * measurement.noise;
    sums.Add(coefficients.col(0), measurement.z - coefficients.col(0).dot(phi_0), variance);
  }
  return Cost(basis, Region::WholePrior(prior.dimension()), reference, sums, prior, 1,
              std::move(element));
}

}  // namespace polyest::internal
