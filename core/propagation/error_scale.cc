#include "core/propagation/error_scale.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {

ErrorScale::ErrorScale(Eigen::Index points, Eigen::Index states, double relative_tolerance)
    : relative_tolerance_(relative_tolerance),
      largest_(Eigen::ArrayXXd::Zero(points, states)),
      scale_(Eigen::ArrayXXd::Constant(points, states, kAbsoluteTolerance)),
      weights_(Eigen::ArrayXXd::Constant(points, states, 1 / kAbsoluteTolerance)),
      block_scale_(Vector::Zero(states)),
      point_norm_(Eigen::ArrayXd::Zero(points)) {}

void ErrorScale::Grow(const Eigen::ArrayXXd& states) {
  // Nothing changes unless a state exceeds its largest magnitude so far.
  if (states.size() == 0 || !((states.abs() - largest_).maxCoeff() > 0)) return;
  largest_ = largest_.max(states.abs());
  for (Eigen::Index s = 0; s < states.cols(); ++s) {
    block_scale_(s) = largest_.col(s).maxCoeff();
    // rtol · S_ps + atol, S_ps = max(own, share of the block's)
    scale_.col(s) = relative_tolerance_ * largest_.col(s).max(kBlockShare * block_scale_(s)) +
                    kAbsoluteTolerance;
  }
  weights_ = scale_.inverse();
}

double ErrorScale::WeightedNorm(const Eigen::ArrayXXd& error, const Eigen::ArrayXXd& weights) {
  const Eigen::Index points = error.rows();
  double* const norm = point_norm_.data();
  std::fill_n(norm, points, 0.0);
  for (Eigen::Index s = 0; s < error.cols(); ++s) {
    const double* const e = error.data() + s * points;
    const double* const w = weights.data() + s * points;
    for (Eigen::Index p = 0; p < points; ++p) {
      const double ratio = std::abs(e[p]) * w[p];
      const double finite = ratio < kHuge ? ratio : kHuge;  // NaN also becomes kHuge
      norm[p] = norm[p] > finite ? norm[p] : finite;
    }
  }
  return point_norm_.maxCoeff();
}

double ErrorScale::GrowingNorm(const Eigen::ArrayXXd& error) {
  const Eigen::Index points = error.rows();
  point_norm_.setZero();
  for (Eigen::Index s = 0; s < error.cols(); ++s) {
    for (Eigen::Index p = 0; p < points; ++p) {
      const double magnitude = relative_tolerance_ * std::abs((*watched_)(p, s));
      // |e_ps| / max(rtol · S_ps + atol, rtol · |x_ps|)
      const double ratio = std::abs(error(p, s)) / std::max(scale_(p, s), magnitude);
      point_norm_(p) = std::max(point_norm_(p), ratio < kHuge ? ratio : kHuge);
    }
  }
  return point_norm_.maxCoeff();
}

double ErrorScale::Norm(const Eigen::ArrayXXd& error, const Eigen::ArrayXXd& weights) {
  const double norm = WeightedNorm(error, weights);
  // The second norm is needed only for a step that the known scales reject while a state exceeds
  // its largest magnitude so far.
  if (norm <= 0.1 || watched_ == nullptr || !((watched_->abs() - largest_).maxCoeff() > 0)) {
    return LargestOf(norm);
  }
  return LargestOf(GrowingNorm(error));
}

// Returns the norm and stores a point that was not finite.
double ErrorScale::LargestOf(double norm) {
  ++norms_since_not_finite_;
  if (norm >= kHuge) {
    point_norm_.maxCoeff(&not_finite_point_);
    norms_since_not_finite_ = 0;
  }
  return norm;
}

Eigen::Index ErrorScale::worst_point() const {
  constexpr int kFew = 32;
  if (not_finite_point_ >= 0 && norms_since_not_finite_ <= kFew) return not_finite_point_;
  Eigen::Index worst = 0;
  if (point_norm_.size() > 0) point_norm_.maxCoeff(&worst);
  return worst;
}

}  // namespace polyest::internal
