#include "core/bayes/cost.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/common/check.h"

namespace polyest {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Points whose matrices are worked on together: they stay in the cache.
constexpr Eigen::Index kBlock = 128;

// J_mismatch + α² J_apriori; without a weight an infinite prior term does not enter.
double Total(double mismatch, double prior, double regularization) {
  return regularization > 0 ? mismatch + regularization * prior : mismatch;
}

}  // namespace

Cost::Cost(std::shared_ptr<const Basis> basis, Region region, Vector reference, MismatchSums sums,
           Prior prior, double regularization)
    : basis_(std::move(basis)),
      region_(std::move(region)),
      reference_phi_(basis_->size()),
      sums_(std::move(sums)),
      prior_(std::move(prior)),
      regularization_(regularization) {
  POLYEST_CHECK(regularization_ >= 0);
  POLYEST_CHECK(basis_->dimension() == region_.dimension());
  POLYEST_CHECK(basis_->dimension() == prior_.dimension());
  POLYEST_CHECK(basis_->size() == sums_.terms());
  basis_->Evaluate(reference, reference_phi_);
}

Vector Cost::BasisDifference(const ConstVectorRef& eta) const {
  Vector d(basis_->size());
  basis_->Evaluate(eta, d);
  return d - reference_phi_;
}

CostValue Cost::Evaluate(const ConstVectorRef& eta) const {
  CostValue value;
  value.mismatch = sums_.ChiSquared(BasisDifference(eta)) / 2;
  const Vector xi = region_.ToGerm(eta);
  value.prior = prior_.NegativeLogDensity(xi);
  value.total =
      prior_.Contains(xi) ? Total(value.mismatch, value.prior, regularization_) : kInfinity;
  return value;
}

CostValue Cost::EvaluateWithGradient(const ConstVectorRef& eta, VectorRef gradient) const {
  Vector d(basis_->size());
  Matrix phi_gradient(basis_->size(), dimension());
  basis_->EvaluateWithGradient(eta, d, phi_gradient);
  d -= reference_phi_;
  const Vector g_d = sums_.G() * d;
  CostValue value;
  // ½ (dᵀ G d − 2 bᵀ d + w)
  value.mismatch = std::max(0.0, d.dot(g_d) - 2 * sums_.b().dot(d) + sums_.w()) / 2;
  const Vector xi = region_.ToGerm(eta);
  value.prior = prior_.NegativeLogDensity(xi);
  // ∇J = ∂φᵀ (G d − b) + α² axesᵀ ∇J_apriori(ξ)
  gradient = phi_gradient.transpose() * (g_d - sums_.b());
  value.total = kInfinity;
  if (prior_.Contains(xi)) {
    value.total = Total(value.mismatch, value.prior, regularization_);
    if (regularization_ > 0) {
      gradient += regularization_ * (region_.axes().transpose() * prior_.Gradient(xi));
    }
  }
  return value;
}

Matrix Cost::MismatchHessian(const ConstVectorRef& eta) const {
  Vector d(basis_->size());
  Matrix phi_gradient(basis_->size(), dimension());
  basis_->EvaluateWithGradient(eta, d, phi_gradient);
  d -= reference_phi_;
  // ∂φᵀ G ∂φ + Σ_s (G d − b)_s ∇²φ_s
  const Matrix hessian = phi_gradient.transpose() * (sums_.G() * phi_gradient) +
                         basis_->WeightedHessian(eta, sums_.G() * d - sums_.b());
  return (hessian + hessian.transpose()) / 2;
}

Matrix Cost::Hessian(const ConstVectorRef& eta) const {
  Matrix hessian = MismatchHessian(eta);
  if (regularization_ > 0) {
    // + α² axesᵀ diag(J_apriori″) axes
    const Vector curvature = prior_.Curvature(region_.ToGerm(eta));
    hessian +=
        regularization_ * (region_.axes().transpose() * curvature.asDiagonal() * region_.axes());
  }
  return hessian;
}

void Cost::EvaluateMany(const ConstMatrixRef& etas, Vector& totals) const {
  POLYEST_CHECK(etas.cols() == dimension());
  // Kept from call to call, so that a sampler's sweeps do not allocate.
  thread_local Matrix difference;  // D = Φ − 1 φ_0ᵀ
  thread_local Matrix product;     // D G
  thread_local Matrix xis;
  totals.resize(etas.rows());
  for (Eigen::Index first = 0; first < etas.rows(); first += kBlock) {
    const Eigen::Index count = std::min(kBlock, etas.rows() - first);
    const auto block = etas.middleRows(first, count);
    basis_->EvaluateMany(block, difference);
    difference.rowwise() -= reference_phi_.transpose();
    product.resize(count, difference.cols());
    product.noalias() = difference * sums_.G();
    // ½ (rowwise (D G)∘D − 2 D b + w)
    product.rowwise() -= 2 * sums_.b().transpose();
    totals.segment(first, count) =
        (product.cwiseProduct(difference).rowwise().sum().array() + sums_.w()).max(0.0) / 2;
    xis.resize(count, dimension());
    xis.noalias() = block * region_.axes().transpose();
    xis.rowwise() += region_.centre().transpose();
    for (Eigen::Index i = 0; i < count; ++i) {
      double& total = totals[first + i];
      const double prior = prior_.NegativeLogDensity(xis.row(i).transpose());
      total = prior_.Contains(xis.row(i).transpose()) ? Total(total, prior, regularization_)
                                                      : kInfinity;
    }
  }
}

}  // namespace polyest
