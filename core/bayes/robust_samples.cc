#include "core/bayes/robust_samples.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/noise.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr Eigen::Index kFirstMemory = 16;  // in samples
// So many factors 1 + u²/ν are multiplied before the logarithm is taken. Their product is finite up
// to |u| = 10³⁸.
constexpr Eigen::Index kFactors = 4;

// Adds ½ (ν + 1) Σ log(1 + u²/ν) of each row of `product`, which holds aᵀd, to `values`.
void AddStudentT(const Matrix& product, const ConstVectorRef& errors, VectorRef values) {
  thread_local Eigen::ArrayXd factors;  // kept, so that a sampler's sweeps do not allocate
  factors.resize(values.size());
  for (Eigen::Index first = 0; first < product.cols(); first += kFactors) {
    const Eigen::Index end = std::min(first + kFactors, product.cols());
    factors.setOnes();
    for (Eigen::Index k = first; k < end; ++k) {
      factors *=
          1 + (errors[k] - product.col(k).array()).square() * (1 / kStudentTDegreesOfFreedom);
    }
    values.array() += 0.5 * (kStudentTDegreesOfFreedom + 1) * factors.log();
  }
}

void AddHuber(const Matrix& product, const ConstVectorRef& errors, VectorRef values) {
  thread_local Eigen::ArrayXd size, inner;
  for (Eigen::Index k = 0; k < product.cols(); ++k) {
    size = (errors[k] - product.col(k).array()).abs();
    inner = size.min(kHuberThreshold);
    values.array() += inner * (size - 0.5 * inner);
  }
}

}  // namespace

bool RobustSamples::IsValid(int terms) const {
  return count_ >= 0 && scaled_.rows() == terms && scaled_.cols() == errors_.size() &&
         count_ <= errors_.size() && scaled_.leftCols(count_).allFinite() &&
         errors_.head(count_).allFinite();
}

void RobustSamples::Add(const ConstVectorRef& coefficients, double error, double variance) {
  POLYEST_CHECK(coefficients.size() == scaled_.rows() && variance > 0);
  if (count_ == errors_.size()) {
    const Eigen::Index room = std::max(kFirstMemory, 2 * errors_.size());
    scaled_.conservativeResize(Eigen::NoChange, room);
    errors_.conservativeResize(room);
  }
  const double unit = 1 / std::sqrt(variance);
  scaled_.col(count_) = unit * coefficients;
  errors_[count_++] = unit * error;
}

// With d = Tᵀd′ + δ: a′ = T a and ε′ = ε − aᵀδ.
RobustSamples RobustSamples::Substituted(const ConstMatrixRef& t, const ConstVectorRef& shift,
                                         double variance) const {
  RobustSamples moved(outliers_, static_cast<int>(t.rows()));
  if (outliers_ == OutlierHandling::kNone) return moved;
  const double unit = 1 / std::sqrt(variance);
  const auto scaled = scaled_.leftCols(count_);
  moved.scaled_ = unit * (t * scaled);
  moved.errors_ = unit * (errors_.head(count_) - scaled.transpose() * shift);
  moved.count_ = count_;
  return moved;
}

Vector RobustSamples::Residuals(const ConstVectorRef& d) const {
  return errors_.head(count_) - scaled_.leftCols(count_).transpose() * d;
}

double RobustSamples::Evaluate(const ConstVectorRef& d) const {
  double value = 0;
  for (const double u : Residuals(d)) value += RobustLoss(outliers_, u);
  return value;
}

double RobustSamples::EvaluateAddingGradient(const ConstVectorRef& d, VectorRef gradient) const {
  Vector slopes = Residuals(d);
  double value = 0;
  for (double& u : slopes) {
    value += RobustLoss(outliers_, u);
    u *= OutlierWeight(outliers_, u);  // ρ′(u)
  }
  gradient -= scaled_.leftCols(count_) * slopes;
  return value;
}

Matrix RobustSamples::Curvature(const ConstVectorRef& d, const ConstMatrixRef& phi_gradient) const {
  Vector curvatures = Residuals(d);
  for (double& u : curvatures) u = RobustCurvature(outliers_, u);
  const Matrix slopes = scaled_.leftCols(count_).transpose() * phi_gradient;
  return slopes.transpose() * curvatures.asDiagonal() * slopes;
}

RobustSamples::Judgement RobustSamples::JudgedAt(const ConstVectorRef& d) const {
  Judgement judged;
  for (const double u : Residuals(d)) {
    const double weight = OutlierWeight(outliers_, u);
    judged.chi_squared += weight * u * u;
    if (weight >= kOutlierWeight) continue;
    ++judged.outliers;
    judged.of_outliers += weight * u * u;
  }
  return judged;
}

void RobustSamples::AddTo(VectorRef values, const ConstMatrixRef& differences,
                          Matrix& product) const {
  if (count_ == 0) return;
  product.resize(differences.rows(), count_);
  product.noalias() = differences * scaled_.leftCols(count_);
  if (outliers_ == OutlierHandling::kStudentT) {
    AddStudentT(product, errors_.head(count_), values);
  } else {
    AddHuber(product, errors_.head(count_), values);
  }
}

}  // namespace polyest::internal
