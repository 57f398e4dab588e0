#include "core/bayes/cost.h"

#include <algorithm>
#include <utility>

#include "core/common/check.h"
#include "core/common/parallel.h"

namespace polyest::internal {
namespace {

// The number of points whose matrices are computed together, so that they stay in the cache.
constexpr Eigen::Index kBlock = 128;
// Operations for one point beside those that grow with the square of the terms.
constexpr int64_t kOtherOperations = 300;

// Returns J_mismatch + α² J_apriori; for α² = 0 an infinite prior term has no effect.
double Total(double mismatch, double prior, double regularization) {
  return regularization > 0 ? mismatch + regularization * prior : mismatch;
}

}  // namespace

Cost::Cost(std::shared_ptr<const Basis> basis, Region region, Vector reference, Mismatch mismatch,
           Prior prior, double regularization, Element element)
    : basis_(std::move(basis)),
      region_(std::move(region)),
      reference_phi_(basis_->size()),
      mismatch_(std::move(mismatch)),
      prior_(std::move(prior)),
      regularization_(regularization),
      element_(std::move(element)) {
  POLYEST_CHECK(regularization_ >= 0);
  POLYEST_CHECK(basis_->dimension() == region_.dimension());
  POLYEST_CHECK(basis_->dimension() == prior_.dimension());
  POLYEST_CHECK(basis_->size() == mismatch_.terms());
  basis_->Evaluate(reference, reference_phi_);
}

Vector Cost::BasisDifference(const ConstVectorRef& eta) const {
  Vector d(basis_->size());
  basis_->Evaluate(eta, d);
  return d - reference_phi_;
}

void Cost::set_remainder(Vector coefficients) {
  POLYEST_CHECK(coefficients.size() == basis_->size());
  remainder_ = std::move(coefficients);
  remainder_constant_ = remainder_.dot(reference_phi_);
}

Cost Cost::AsStated() const {
  Cost stated = *this;
  stated.power_ = 1;
  stated.prior_ = prior_.WithModesOfUniform();
  return stated;
}

CostValue Cost::Evaluate(const ConstVectorRef& eta) const {
  CostValue value;
  const Vector d = BasisDifference(eta);
  value.mismatch = mismatch_.Evaluate(d);
  const Vector xi = region_.ToGerm(eta);
  value.prior = prior_.NegativeLogDensity(xi);
  value.total =
      Supports(xi) ? Total(power_ * value.mismatch, value.prior, regularization_) : kInfinity;
  if (has_remainder()) value.total += power_ * (remainder_.dot(d) + remainder_constant_);
  if (population_ != nullptr) value.total += population_->Evaluate(xi, power_);
  return value;
}

CostValue Cost::EvaluateWithGradient(const ConstVectorRef& eta, VectorRef gradient) const {
  Vector d(basis_->size());
  Matrix phi_gradient(basis_->size(), dimension());
  basis_->EvaluateWithGradient(eta, d, phi_gradient);
  d -= reference_phi_;
  Vector by_d(d.size());
  CostValue value;
  value.mismatch = mismatch_.EvaluateWithGradient(d, by_d);
  const Vector xi = region_.ToGerm(eta);
  value.prior = prior_.NegativeLogDensity(xi);
  // ∇J = β ∂φᵀ (∂J_mismatch/∂d + ∂J_0/∂d) + α² axesᵀ ∇J_apriori(ξ)
  if (has_remainder()) by_d += remainder_;
  gradient = power_ * (phi_gradient.transpose() * by_d);
  value.total = kInfinity;
  if (Supports(xi)) {
    value.total = Total(power_ * value.mismatch, value.prior, regularization_);
    if (regularization_ > 0) {
      gradient += regularization_ * (region_.axes().transpose() * prior_.Gradient(xi));
    }
  }
  if (has_remainder()) value.total += power_ * (remainder_.dot(d) + remainder_constant_);
  if (population_ != nullptr) {
    const PopulationCost::Derivatives derivatives = population_->Differentiate(xi, power_);
    value.total += derivatives.value;
    gradient += region_.axes().transpose() * derivatives.gradient;
  }
  return value;
}

// Returns the Hessian of β J_mismatch or, with the remainder J_0, of β (J_mismatch + J_0).
Matrix Cost::HessianOfData(const ConstVectorRef& eta, double spent, bool with_remainder) const {
  Vector d(basis_->size());
  Matrix phi_gradient(basis_->size(), dimension());
  basis_->EvaluateWithGradient(eta, d, phi_gradient);
  const Vector phi = d;
  d -= reference_phi_;
  Vector by_d(d.size());
  mismatch_.EvaluateWithGradient(d, by_d);
  if (with_remainder) by_d += remainder_;
  // ∂φᵀ ∂²J/∂d² ∂φ + Σ_s (∂J/∂d)_s ∇²φ_s
  const Matrix hessian = mismatch_.Curvature(d, phi_gradient, spent) +
                         basis_->WeightedHessian(eta, phi, phi_gradient, by_d);
  return 0.5 * power_ * (hessian + hessian.transpose());
}

// Adds the Hessian of J_P, where there is a population.
void Cost::AddPopulation(const ConstVectorRef& eta, Matrix& hessian) const {
  if (population_ == nullptr) return;
  const Matrix of_population = population_->Differentiate(region_.ToGerm(eta), power_).hessian;
  hessian += region_.axes().transpose() * of_population * region_.axes();
}

Matrix Cost::MismatchHessian(const ConstVectorRef& eta, double spent) const {
  return HessianOfData(eta, spent, /*with_remainder=*/false);
}

Matrix Cost::InformationHessian(const ConstVectorRef& eta, double spent) const {
  Matrix hessian = MismatchHessian(eta, spent);
  AddPopulation(eta, hessian);
  return hessian;
}

Matrix Cost::Hessian(const ConstVectorRef& eta, double spent) const {
  Matrix hessian = HessianOfData(eta, spent, has_remainder());
  AddPopulation(eta, hessian);
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
  totals.resize(etas.rows());
  const auto blocks = static_cast<int>((etas.rows() + kBlock - 1) / kBlock);
  const int64_t operations = etas.rows() * (basis_->size() * basis_->size() + kOtherOperations);
  // A population takes much longer, by as much as there are runs.
  const int threads = population_ != nullptr ? threads_ : ThreadsFor(operations, threads_);
  ParallelFor(blocks, threads, [&](int block) {
    const Eigen::Index first = block * kBlock;
    const Eigen::Index count = std::min(kBlock, etas.rows() - first);
    EvaluateBlock(etas.middleRows(first, count), totals.segment(first, count));
  });
}

void Cost::EvaluateBlock(const ConstMatrixRef& etas, VectorRef totals) const {
  // The memory is kept between calls, so that a sampler's sweeps do not allocate.
  thread_local Matrix difference;  // D = Φ − 1 φ_0ᵀ
  thread_local Matrix product;
  thread_local Matrix xis;
  thread_local Vector remainders;
  thread_local Vector priors;
  thread_local Vector xi;
  basis_->EvaluateMany(etas, difference);
  difference.rowwise() -= reference_phi_.transpose();
  mismatch_.EvaluateMany(difference, product, totals);
  if (has_remainder()) remainders = difference * remainder_;
  xis.resize(etas.rows(), dimension());
  xis.noalias() = etas * region_.axes().transpose();
  xis.rowwise() += region_.centre().transpose();
  priors.resize(etas.rows());
  prior_.NegativeLogDensityMany(xis, priors);
  for (Eigen::Index i = 0; i < totals.size(); ++i) {
    xi = xis.row(i).transpose();
    totals[i] = Supports(xi) ? Total(power_ * totals[i], priors[i], regularization_) : kInfinity;
    if (has_remainder()) totals[i] += power_ * (remainders[i] + remainder_constant_);
    if (population_ != nullptr) totals[i] += population_->Evaluate(xi, power_);
  }
}

}  // namespace polyest::internal
