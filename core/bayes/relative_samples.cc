#include "core/bayes/relative_samples.h"

#include <algorithm>
#include <cmath>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr Eigen::Index kRoomToBegin = 16;  // in samples
// So many ratios of variances are multiplied before the logarithm is taken. Their product is finite
// up to a ratio of 10⁷⁷.
constexpr Eigen::Index kRatios = 4;

}  // namespace

// Where σ is at its least, it is the same as for a larger magnitude.
RelativeDeviation RelativeDeviation::Of(const NoiseModel& model, double largest, double scale) {
  const double full = model.full_scale > 0 ? model.full_scale : largest;
  const double constant = model.absolute + model.relative_to_max * full;
  return {scale * constant, scale * model.relative,
          std::max(NoiseModel::kMinMagnitude * largest, (model.least - constant) / model.relative)};
}

double RelativeDeviation::At(double y) const {
  return at_zero + slope * std::max(std::abs(y), least_magnitude);
}

bool RelativeSamples::IsValid(int terms) const {
  return count_ >= 0 && coefficients_.rows() == terms && facts_.rows() == kFacts &&
         coefficients_.cols() == facts_.cols() && count_ <= facts_.cols() &&
         coefficients_.leftCols(count_).allFinite() && facts_.leftCols(count_).allFinite() &&
         (facts_.row(kReference).head(count_).array() > 0).all();
}

void RelativeSamples::Add(const ConstVectorRef& coefficients, double z, double predicted,
                          const RelativeDeviation& deviation, double own_error,
                          double reference_variance) {
  POLYEST_CHECK(coefficients.size() == coefficients_.rows() && reference_variance > 0);
  if (count_ == facts_.cols()) {
    const Eigen::Index room = std::max(kRoomToBegin, 2 * facts_.cols());
    coefficients_.conservativeResize(Eigen::NoChange, room);
    facts_.conservativeResize(Eigen::NoChange, room);
  }
  coefficients_.col(count_) = coefficients;
  facts_.col(count_++) << z, predicted, deviation.at_zero, deviation.slope,
      deviation.least_magnitude, own_error, reference_variance;
}

// With d = Tᵀd′ + δ: c′ = T c and y_0′ = y_0 + cᵀδ.
RelativeSamples RelativeSamples::Substituted(const ConstMatrixRef& t,
                                             const ConstVectorRef& shift) const {
  RelativeSamples moved(keeps_, static_cast<int>(t.rows()));
  if (!keeps_) return moved;
  moved.coefficients_ = t * coefficients_.leftCols(count_);
  moved.facts_ = facts_.leftCols(count_);
  moved.facts_.row(kPredicted) += shift.transpose() * coefficients_.leftCols(count_);
  moved.count_ = count_;
  return moved;
}

Vector RelativeSamples::Predictions(const ConstVectorRef& d) const {
  return facts_.row(kPredicted).head(count_).transpose() +
         coefficients_.leftCols(count_).transpose() * d;
}

// R = σ² + ρ,  R′ = 2 σ σ′,  R″ = 2 σ′²
RelativeSamples::Variance RelativeSamples::VarianceAt(int64_t k, double y) const {
  const auto fact = facts_.col(k);
  const bool flat = std::abs(y) <= fact[kMinMagnitude];
  const double slope = flat ? 0 : std::copysign(fact[kSlope], y);
  const double sigma = RelativeDeviation{fact[kAtZero], fact[kSlope], fact[kMinMagnitude]}.At(y);
  return {sigma * sigma + fact[kOwnError], 2 * sigma * slope, 2 * slope * slope};
}

RelativeSamples::Totals RelativeSamples::At(const ConstVectorRef& d) const {
  Totals totals;
  const Vector y = Predictions(d);
  for (Eigen::Index k = 0; k < count_; ++k) {
    const double variance = VarianceAt(k, y[k]).value;
    const double error = facts_(kValue, k) - y[k];
    totals.chi_squared += error * error / variance;
    totals.log_variance += std::log(variance / facts_(kReference, k));
  }
  return totals;
}

// ∂A/∂y = −2 e/R − e² R′/R²,  ∂L/∂y = R′/R
RelativeSamples::Totals RelativeSamples::WithGradients(const ConstVectorRef& d,
                                                       VectorRef of_chi_squared,
                                                       VectorRef of_log_variance) const {
  Totals totals;
  const Vector y = Predictions(d);
  Vector by_a(count_), by_l(count_);
  for (Eigen::Index k = 0; k < count_; ++k) {
    const Variance r = VarianceAt(k, y[k]);
    const double u = (facts_(kValue, k) - y[k]) / r.value;
    totals.chi_squared += u * u * r.value;
    totals.log_variance += std::log(r.value / facts_(kReference, k));
    by_a[k] = -2 * u - u * u * r.first;
    by_l[k] = r.first / r.value;
  }
  of_chi_squared.noalias() = coefficients_.leftCols(count_) * by_a;
  of_log_variance.noalias() = coefficients_.leftCols(count_) * by_l;
  return totals;
}

// With u = e/R,
//   ∂²A/∂y² = 2/R + 4 u R′/R − u² R″ + 2 u² R′²/R,  ∂²L/∂y² = R″/R − R′²/R².
Matrix RelativeSamples::Curvature(const ConstVectorRef& d, const ConstMatrixRef& phi_gradient,
                                  double a, double l) const {
  Vector curvatures = Predictions(d);
  for (Eigen::Index k = 0; k < count_; ++k) {
    const Variance r = VarianceAt(k, curvatures[k]);
    const double u = (facts_(kValue, k) - curvatures[k]) / r.value;
    const double g = r.first / r.value;
    const double of_a = (2 + 4 * u * r.first) / r.value + u * u * (2 * g * r.first - r.second);
    curvatures[k] = a * of_a + l * (r.second / r.value - g * g);
  }
  const Matrix slopes = coefficients_.leftCols(count_).transpose() * phi_gradient;
  return slopes.transpose() * curvatures.asDiagonal() * slopes;
}

void RelativeSamples::EvaluateMany(const ConstMatrixRef& differences, Matrix& product,
                                   VectorRef chi_squared, VectorRef log_variance) const {
  thread_local Eigen::ArrayXd y, variances, factors;  // kept, so that sweeps do not allocate
  chi_squared.setZero();
  log_variance.setZero();
  product.resize(differences.rows(), count_);
  product.noalias() = differences * coefficients_.leftCols(count_);
  factors.resize(differences.rows());
  for (Eigen::Index first = 0; first < count_; first += kRatios) {
    factors.setOnes();
    for (Eigen::Index k = first; k < std::min<Eigen::Index>(first + kRatios, count_); ++k) {
      const auto fact = facts_.col(k);
      y = product.col(k).array() + fact[kPredicted];
      variances = (fact[kAtZero] + fact[kSlope] * y.abs().max(fact[kMinMagnitude])).square() +
                  fact[kOwnError];
      chi_squared.array() += (fact[kValue] - y).square() / variances;
      factors *= variances * (1 / fact[kReference]);
    }
    log_variance.array() += factors.log();
  }
}

}  // namespace polyest::internal
