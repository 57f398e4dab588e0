#include "core/chaos/expansion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/chaos/collocation_points.h"
#include "core/common/check.h"

namespace polyest::internal {

Expansion::Expansion(std::shared_ptr<const Basis> basis, Matrix coefficients)
    : basis_(std::move(basis)), coefficients_(std::move(coefficients)) {
  POLYEST_CHECK(basis_ != nullptr && coefficients_.rows() == basis_->size());
}

Vector Expansion::Mean() const { return coefficients_.row(0).transpose(); }

Vector Expansion::StandardDeviation() const {
  // √(Σ_{s≥1} c_s²)
  return coefficients_.bottomRows(coefficients_.rows() - 1).colwise().norm().transpose();
}

Vector Expansion::Evaluate(const ConstVectorRef& xi) const {
  Vector phi(basis_->size());
  basis_->Evaluate(xi, phi);
  return coefficients_.transpose() * phi;
}

Matrix Expansion::Sample(int count) const {
  constexpr Eigen::Index kDrawsAtATime = 1024;  // bounds the memory for the basis
  const Matrix draws = HaltonDraws(basis_->germs(), count);
  Matrix samples(count, coefficients_.cols());
  Matrix phi;
  for (Eigen::Index first = 0; first < count; first += kDrawsAtATime) {
    const Eigen::Index rows = std::min(kDrawsAtATime, count - first);
    basis_->EvaluateMany(draws.middleRows(first, rows), phi);
    samples.middleRows(first, rows).noalias() = phi * coefficients_;
  }
  return samples;
}

DensityEstimate DensityOfSamples(const ConstVectorRef& samples, int bins) {
  POLYEST_CHECK(samples.size() > 0 && bins >= 1 && samples.allFinite());
  const double lowest = samples.minCoeff();
  const double width = (samples.maxCoeff() - lowest) / bins;
  // The samples do not vary, or so little that the density would overflow.
  if (!(width > std::numeric_limits<double>::min())) {
    return {Vector::Constant(1, lowest), Vector::Ones(1)};
  }
  DensityEstimate estimate{Vector(bins), Vector::Zero(bins)};
  for (int i = 0; i < bins; ++i) estimate.value[i] = lowest + (i + 0.5) * width;
  const double share = 1 / (width * static_cast<double>(samples.size()));
  for (const double sample : samples) {
    // The highest sample belongs to the last bin.
    const int bin = std::min(static_cast<int>((sample - lowest) / width), bins - 1);
    estimate.density[bin] += share;
  }
  return estimate;
}

double QuantileOfSorted(const ConstVectorRef& sorted, double probability) {
  POLYEST_CHECK(sorted.size() > 0 && probability >= 0 && probability <= 1);
  const double position = probability * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<Eigen::Index>(std::floor(position));
  const Eigen::Index above = std::min(below + 1, sorted.size() - 1);
  const double fraction = position - static_cast<double>(below);
  return (1 - fraction) * sorted[below] + fraction * sorted[above];
}

}  // namespace polyest::internal
