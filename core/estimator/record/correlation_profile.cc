#include "core/estimator/record/correlation_profile.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/bayes/mismatch.h"
#include "core/common/check.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// The fixed point of the scale converges by the factor p/N a step, or faster.
constexpr int kScaleSteps = 20;
// How far the white shares reach beyond the range in which both parts can be seen: a factor e.
constexpr double kMargin = 1;
// From which on the logarithm of a product is taken, so that it does not underflow.
constexpr double kMinProduct = 1e-150;

}  // namespace

double TimeConstantGrid::At(int step) const {
  return shortest_s * std::pow(longest_s / shortest_s, step / (kSteps - 1.0));
}

double TimeConstantGrid::ShareAt(double time_constant_s, int index) const {
  const double intervals = time_constant_s * kShortestInIntervals / shortest_s;
  const double largest = kMargin + std::log1p(2 * intervals);
  const double log_odds = largest * (2 * index / (kShares - 1.0) - 1);
  return 1 / (1 + std::exp(-log_odds));
}

NoiseShape Neighbour(const NoiseShape& noise, double time_constant_steps, double share_steps) {
  // f/(1 − f) times e^x
  const double correlated = (1 - noise.white_share) * std::exp(-kStepOfShare * share_steps);
  return {noise.time_constant_s * std::exp(kStepOfTimeConstant * time_constant_steps),
          noise.white_share / (noise.white_share + correlated)};
}

NoiseShape AlikeOverShortTimes(const NoiseShape& noise, double factor) {
  const double correlated = (1 - noise.white_share) * factor;
  return {noise.time_constant_s * factor, noise.white_share / (noise.white_share + correlated)};
}

CorrelationProfile::CorrelationProfile(const TimeConstantGrid& grid, const NoiseShape& present,
                                       Eigen::Index unknowns) {
  shapes_ = {present, NoiseShape()};
  for (int step = 0; step < TimeConstantGrid::kSteps; ++step) shapes_.push_back({grid.At(step), 0});
  const int first = TimeConstantGrid::kStride - 1;
  for (int step = first; step < TimeConstantGrid::kSteps; step += TimeConstantGrid::kStride) {
    for (int index = 0; index < TimeConstantGrid::kShares; ++index) {
      shapes_.push_back({grid.At(step), grid.ShareAt(grid.At(step), index)});
    }
  }
  if (present.white_share > 0) {
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) shapes_.push_back(Neighbour(present, i, j));
    }
    for (const double factor : kLongTimeFactors) {
      shapes_.push_back(AlikeOverShortTimes(present, factor));
    }
  }
  const auto members = static_cast<Eigen::Index>(shapes_.size());
  share_.resize(members);
  for (Eigen::Index i = 0; i < members; ++i) {
    share_[i] = shapes_[static_cast<size_t>(i)].white_share;
  }
  variance_ = Vector::Zero(members);
  state_ = Matrix::Zero(members, unknowns + 1);
  gram_ = Matrix::Zero(members, (unknowns + 1) * (unknowns + 2) / 2);
  log_determinant_ = Vector::Zero(members);
  product_ = Vector::Ones(members);
  Allocate();
}

// Allocates what is not part of the state.
void CorrelationProfile::Allocate() {
  const Eigen::Index members = share_.size();
  if (innovation_.size() == members) return;
  interval_s_ = -1;
  for (Vector* scratch : {&correlation_, &added_, &innovation_, &kept_, &precision_, &weighted_}) {
    scratch->resize(members);
  }
  difference_.resize(members, state_.cols());
  row_.resize(state_.cols());
}

void CorrelationProfile::BeginRun() { known_ = 0; }

// Sets the correlation of samples at this distance. Most records are sampled regularly, so it
// rarely changes.
void CorrelationProfile::SetInterval(double interval_s) {
  if (interval_s == interval_s_) return;
  interval_s_ = interval_s;
  double set_s = -1, a = 0, innovation = 1;  // a and 1 − a² for the time constant set last
  for (size_t i = 0; i < shapes_.size(); ++i) {
    const double time_constant_s = shapes_[i].time_constant_s;
    if (time_constant_s != set_s) {
      set_s = time_constant_s;
      const double decay = set_s > 0 ? interval_s / set_s : kInfinity;
      a = std::exp(-decay);
      innovation = -std::expm1(-2 * decay);
    }
    const auto member = static_cast<Eigen::Index>(i);
    correlation_[member] = a;
    added_[member] = innovation * (1 - share_[member]);
  }
}

// Advances v̂, P⁻ and S of every member to a sample at this time.
void CorrelationProfile::Predict(double time_s) {
  if (known_ == 0) {
    state_.setZero();
    variance_.array() = 1 - share_.array();
    innovation_.setOnes();
    return;
  }
  SetInterval(time_s - time_s_);
  state_.array().colwise() *= correlation_.array();
  variance_.array() = correlation_.array().square() * variance_.array() + added_.array();
  innovation_ = variance_ + share_;
}

void CorrelationProfile::Add(double time_s, const ConstVectorRef& gradient, double residual,
                             double weight) {
  if (empty()) return;
  const Eigen::Index n = gradient.size();
  POLYEST_CHECK(state_.cols() == n + 1);
  Allocate();  // only after the profile has been restored
  Predict(time_s);
  const auto present = static_cast<Eigen::Index>(kPresent);
  row_.head(n) = gradient;
  row_[n] = residual;
  // v = v̂ + √S u: undoes the whitening with the present noise.
  row_ = state_.row(present).transpose() + std::sqrt(innovation_[present]) * row_;
  kept_.array() = share_.array() / innovation_.array();  // f/S
  variance_.array() *= kept_.array();
  precision_.array() = weight / innovation_.array();
  for (Eigen::Index j = 0, pair = 0; j <= n; ++j) {
    auto difference = difference_.col(j).array();
    difference = row_[j] - state_.col(j).array();
    state_.col(j).array() = row_[j] - kept_.array() * difference;
    weighted_.array() = precision_.array() * difference;
    for (Eigen::Index i = 0; i <= j; ++i, ++pair) {
      gram_.col(pair).array() += weighted_.array() * difference_.col(i).array();
    }
  }
  product_.array() *= innovation_.array();
  if (product_.minCoeff() < kMinProduct) {
    log_determinant_.array() += 0.5 * product_.array().log();
    product_.setOnes();
  }
  known_ = 1;
  time_s_ = time_s;
}

std::vector<CorrelationProfile::Member> CorrelationProfile::Members() const {
  std::vector<Member> members;
  for (size_t i = 0; i < shapes_.size(); ++i) {
    const auto m = static_cast<Eigen::Index>(i);
    Member member{.noise = shapes_[i],
                  .log_determinant = log_determinant_[m] + 0.5 * std::log(product_[m]),
                  .gram = Matrix::Zero(state_.cols(), state_.cols())};
    for (Eigen::Index j = 0, pair = 0; j < state_.cols(); ++j) {
      for (Eigen::Index k = 0; k <= j; ++k, ++pair) member.gram(k, j) = gram_(m, pair);
    }
    members.push_back(std::move(member));
  }
  return members;
}

bool CorrelationProfile::HasSizesOf(const CorrelationProfile& other) const {
  const auto alike = [](const auto& a, const auto& b) {
    return a.rows() == b.rows() && a.cols() == b.cols() && a.allFinite();
  };
  return shapes_ == other.shapes_ && share_ == other.share_ && alike(variance_, other.variance_) &&
         alike(state_, other.state_) && alike(gram_, other.gram_) &&
         alike(log_determinant_, other.log_determinant_) && alike(product_, other.product_) &&
         std::isfinite(time_s_);
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
