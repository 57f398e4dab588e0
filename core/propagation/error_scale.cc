#include "core/propagation/error_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

// Returns the larger norm, kHuge in place of a larger or undefined `ratio`.
inline double LargerNorm(double norm, double ratio) {
  const double finite = ratio < ErrorScale::kHuge ? ratio : ErrorScale::kHuge;
  return norm > finite ? norm : finite;
}

}  // namespace

ErrorScale::ErrorScale(Eigen::Index points, Eigen::Index states, double relative_tolerance)
    : relative_tolerance_(relative_tolerance),
      largest_(Eigen::ArrayXXd::Zero(points, states)),
      scale_(points, states),
      weights_(points, states),
      block_scale_(Vector::Zero(states)),
      floor_(Vector::Zero(states)),
      expected_(Vector::Zero(states)),
      point_norm_(Eigen::ArrayXd::Zero(points)) {
  for (Eigen::Index s = 0; s < states; ++s) SetScale(s);
}

void ErrorScale::SetScale(Eigen::Index state) {
  // rtol · S_ps + floor_s, S_ps = max(own, share of the block's). The smallest number stands in for
  // 0, so that the weights stay finite.
  scale_.col(state) =
      (relative_tolerance_ * largest_.col(state).max(kBlockShare * block_scale_(state)) +
       floor_(state))
          .max(std::numeric_limits<double>::min());
  weights_.col(state) = scale_.col(state).inverse();
}

void ErrorScale::Grow(const Eigen::ArrayXXd& states) {
  if (states.rows() == 0) return;
  for (Eigen::Index s = 0; s < states.cols(); ++s) {
    // Nothing changes unless the state exceeds its largest magnitude so far.
    if (!((states.col(s).abs() - largest_.col(s)).maxCoeff() > 0)) continue;
    largest_.col(s) = largest_.col(s).max(states.col(s).abs());
    block_scale_(s) = largest_.col(s).maxCoeff();
    SetScale(s);
  }
}

bool ErrorScale::NeedsFloors() const {
  return block_scale_at_floors_.size() == 0 ||
         (block_scale_.array() > 2 * block_scale_at_floors_.array()).any() ||
         (block_scale_at_floors_.array() == 0).any();
}

void ErrorScale::SetFloors(const Vector& largest_changes, const Vector& expected_sizes) {
  constexpr double kExpectedShare = 1e-6;
  constexpr double kCancelled = 1e-10;
  constexpr double kRoundings = 100 * std::numeric_limits<double>::epsilon();
  block_scale_at_floors_ = block_scale_;
  // What was expected of a state at rest counts until it has grown: in a chain of masses the last
  // one moves like a high power of the time, which no step follows relative to itself.
  expected_ = expected_.cwiseMax(expected_sizes);
  for (Eigen::Index s = 0; s < floor_.size(); ++s) {
    const double change = largest_changes(s);
    const bool cancelled = block_scale_(s) < kCancelled * change;
    floor_(s) = cancelled ? kRoundings * change : 0;
    if (block_scale_(s) <= kExpectedShare * expected_(s)) {
      floor_(s) = std::max(floor_(s), relative_tolerance_ * kExpectedShare * expected_(s));
    }
    SetScale(s);
  }
}

double ErrorScale::SizeOf(Eigen::Index state) const {
  if (block_scale_(state) > 0) return block_scale_(state);
  return expected_(state) > 0 ? expected_(state) : 1;
}

double ErrorScale::WeightedNorm(const Eigen::ArrayXXd& error, const Eigen::ArrayXXd& weights) {
  const Eigen::Index points = error.rows();
  double* const norm = point_norm_.data();
  std::fill_n(norm, points, 0.0);
  for (Eigen::Index s = 0; s < error.cols(); ++s) {
    const double* const e = error.data() + s * points;
    const double* const w = weights.data() + s * points;
    for (Eigen::Index p = 0; p < points; ++p) norm[p] = LargerNorm(norm[p], std::abs(e[p]) * w[p]);
  }
  return point_norm_.maxCoeff();
}

double ErrorScale::GrowingNorm(const Eigen::ArrayXXd& error) {
  const Eigen::Index points = error.rows();
  double* const norm = point_norm_.data();
  std::fill_n(norm, points, 0.0);
  for (Eigen::Index s = 0; s < error.cols(); ++s) {
    const double* const e = error.data() + s * points;
    const double* const x = watched_->data() + s * points;
    const double* const known = scale_.data() + s * points;
    for (Eigen::Index p = 0; p < points; ++p) {
      // |e_ps| / max(rtol · S_ps + floor_s, rtol · |x_ps|)
      const double present = relative_tolerance_ * std::abs(x[p]);
      const double scale = known[p] > present ? known[p] : present;
      norm[p] = LargerNorm(norm[p], std::abs(e[p]) / scale);
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
