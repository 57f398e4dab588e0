#include "core/estimator/record/correlation_profile.h"

#include <algorithm>
#include <cmath>

#include "core/common/check.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// The fixed point of the scale converges by the factor p/N a step, or faster.
constexpr int kScaleSteps = 20;
constexpr double kMinMeanSquare = 1e-24;  // of residuals that vanish, in units of the working noise

}  // namespace

double TimeConstantGrid::At(int step) const {
  return shortest_s * std::pow(longest_s / shortest_s, step / (kSteps - 1.0));
}

CorrelationProfile::CorrelationProfile(const TimeConstantGrid& grid, double present_s,
                                       Eigen::Index unknowns)
    : previous_(Vector::Zero(unknowns + 1)), row_(unknowns + 1) {
  const auto add = [&](double time_constant_s) {
    members_.push_back(
        {.time_constant_s = time_constant_s, .gram = Matrix::Zero(unknowns + 1, unknowns + 1)});
  };
  add(present_s);
  add(0);
  for (int step = 0; step < TimeConstantGrid::kSteps; ++step) add(grid.At(step));
}

void CorrelationProfile::BeginRun() { known_ = 0; }

// Sets the correlation of samples at this distance. Most records are sampled regularly, so it
// rarely changes.
void CorrelationProfile::SetInterval(double interval_s) {
  if (interval_s == interval_s_) return;
  interval_s_ = interval_s;
  for (Member& member : members_) {
    if (member.time_constant_s <= 0) continue;
    const double decay = interval_s / member.time_constant_s;
    member.correlation = std::exp(-decay);
    member.log_innovation = 0.5 * std::log(-std::expm1(-2 * decay));
  }
}

void CorrelationProfile::Add(double time_s, const ConstVectorRef& gradient, double residual,
                             double weight) {
  if (empty()) return;
  const Eigen::Index n = gradient.size();
  POLYEST_CHECK(previous_.size() == n + 1);
  row_.resize(n + 1);  // allocates only after the profile has been restored
  row_.head(n) = gradient;
  row_[n] = residual;
  if (known_ == 0) {
    for (Member& member : members_) {
      member.gram.triangularView<Eigen::Upper>() += weight * row_ * row_.transpose();
    }
  } else {
    SetInterval(time_s - time_s_);
    // v_k = a v_{k−1} + √(1 − a²) v'_k: undoes the whitening with the present time constant.
    const Member& present = members_[kPresent];
    if (present.time_constant_s > 0) {
      row_ = present.correlation * previous_ + std::exp(present.log_innovation) * row_;
    }
    for (Member& member : members_) {
      const double precision = weight * std::exp(-2 * member.log_innovation);
      const double a = member.correlation;
      for (Eigen::Index j = 0; j <= n; ++j) {
        const double u = precision * (row_[j] - a * previous_[j]);
        member.gram.col(j).head(j + 1) += u * (row_.head(j + 1) - a * previous_.head(j + 1));
      }
      member.log_determinant += member.log_innovation;
    }
  }
  known_ = 1;
  time_s_ = time_s;
  previous_.swap(row_);
}

bool CorrelationProfile::HasSizesOf(const CorrelationProfile& other) const {
  const Eigen::Index size = other.previous_.size();
  return members_.size() == other.members_.size() && previous_.size() == size &&
         previous_.allFinite() && std::isfinite(time_s_) &&
         std::ranges::all_of(members_, [size](const Member& member) {
           return member.gram.rows() == size && member.gram.cols() == size &&
                  member.gram.allFinite() && std::isfinite(member.log_determinant);
         });
}

ProfileValue EvaluateMember(const CorrelationProfile::Member& member, double degrees,
                            const ConstMatrixRef& unit, bool scale_unknown) {
  const Eigen::Index n = unit.rows();
  const Matrix gram = member.gram.selfadjointView<Eigen::Upper>();
  const double w = gram(n, n);
  const SymmetricEigen eigen =
      DecomposeSymmetric(unit.transpose() * gram.topLeftCorner(n, n) * unit);
  const Vector b = eigen.vectors.transpose() * (unit.transpose() * gram.col(n).head(n));
  const Eigen::ArrayXd information = eigen.values.array().max(0);
  const double least = kMinMeanSquare * std::max(1.0, degrees);
  ProfileValue value;
  double s2 = 1;
  Eigen::ArrayXd delta;
  for (int step = 0; step < (scale_unknown ? kScaleSteps : 1); ++step) {
    delta = b.array() / (information + s2);
    const double gained = (delta * (2 * b.array() - information * delta)).sum();
    value.chi_squared = std::max(least, w - gained);
    if (!scale_unknown) break;
    const double fitted = (information / (information + s2)).sum();
    s2 = value.chi_squared / std::max(1.0, degrees - fitted);
  }
  value.scale = std::sqrt(s2);
  value.negative_log_likelihood = 0.5 * (degrees * std::log(s2) + value.chi_squared / s2 +
                                         delta.square().sum() + (information / s2).log1p().sum()) +
                                  member.log_determinant;
  return value;
}

}  // namespace polyest::internal
