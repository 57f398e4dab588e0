#include "core/bayes/outlier_density.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/bayes/log_sum_exp.h"
#include "core/bayes/noise.h"
#include "core/chaos/normal.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

// Nodes of x = log of the factor of the working noise. The polynomial through six of them is good
// to 10⁻⁷ of a sample's loss.
constexpr int kSizes = 31;
constexpr double kSizeStep = 0.1, kFirstSize = -1.5;
constexpr int kPresentSize = 15;  // x = 0
constexpr int kInterpolated = 6;
// The integral over x: so many steps within so many standard deviations to either side.
constexpr Eigen::Index kIntegratedSteps = 480;
constexpr double kIntegratedReach = 12;
constexpr double kVanishedDensity = 12;  // −log of the density relative to its largest value
constexpr int kPerNode = 20;             // points at which the largest value is sought

using SizeNodes = Eigen::Array<double, kSizes, 1>;

// Returns e^{−x} at the nodes.
const SizeNodes& Shrinkage() {
  static const SizeNodes shrinkage =
      (-(kFirstSize + kSizeStep * SizeNodes::LinSpaced(kSizes, 0, kSizes - 1))).exp();
  return shrinkage;
}

// Returns the polynomial through the six nodes about x, at x.
double Interpolated(const Vector& values, double x) {
  const double place = (x - kFirstSize) / kSizeStep;
  const int first = std::clamp(static_cast<int>(std::floor(place)) - kInterpolated / 2 + 1, 0,
                               kSizes - kInterpolated);
  double sum = 0;
  for (int i = 0; i < kInterpolated; ++i) {
    double factor = values[first + i];
    for (int j = 0; j < kInterpolated; ++j) {
      if (j != i) factor *= (place - first - j) / (i - j);
    }
    sum += factor;
  }
  return sum;
}

}  // namespace

OutlierDensity::OutlierDensity(OutlierHandling outliers, bool size_unknown) : outliers_(outliers) {
  if (outliers == OutlierHandling::kNone) return;
  losses_.setZero(size_unknown ? kSizes : 1);
  curvatures_ = losses_;
}

bool OutlierDensity::IsValidLike(const OutlierDensity& fresh) const {
  return outliers_ == fresh.outliers_ && losses_.size() == fresh.losses_.size() &&
         curvatures_.size() == fresh.curvatures_.size() && count_ >= 0 && std::isfinite(excess_) &&
         std::isfinite(precision_) && losses_.allFinite() && curvatures_.allFinite();
}

void OutlierDensity::Add(double u, double precision, double excess) {
  POLYEST_CHECK(outliers_ != OutlierHandling::kNone);
  ++count_;
  excess_ += excess;
  precision_ += precision;
  if (losses_.size() == 1) {
    losses_[0] += RobustLoss(outliers_, u);
    curvatures_[0] += RobustCurvature(outliers_, u);
    return;
  }
  const SizeNodes& shrinkage = Shrinkage();
  if (outliers_ == OutlierHandling::kHuber) {
    const SizeNodes size = std::abs(u) * shrinkage;
    const SizeNodes inner = size.min(kHuberThreshold);
    losses_.array() += inner * (size - 0.5 * inner);
    curvatures_.array() += (size <= kHuberThreshold).select(shrinkage.square(), 0);
    return;
  }
  constexpr double kDegrees = kStudentTDegreesOfFreedom;
  const SizeNodes square = (u * shrinkage).square() * (1 / kDegrees);
  losses_.array() += 0.5 * (kDegrees + 1) * (1 + square).log();
  // ρ″ = (ν + 1)/ν · (1 − u²/ν)/(1 + u²/ν)²
  curvatures_.array() +=
      (1 + 1 / kDegrees) * shrinkage.square() * ((1 - square) / (1 + square)) / (1 + square);
}

double OutlierDensity::NormalizationOfAll() const {
  return static_cast<double>(count_) * (0.5 * kLogTwoPi + LackOfDensity(outliers_));
}

OutlierDensity::Value OutlierDensity::OfKnownSize() const {
  if (count_ == 0) return {0, 1, 1};
  const Eigen::Index present = losses_.size() == 1 ? 0 : kPresentSize;
  return {-losses_[present] - NormalizationOfAll(), curvatures_[present] / precision_,
          VarianceFactor(outliers_)};
}

std::optional<OutlierDensity::Value> OutlierDensity::OfUnknownSize() const {
  POLYEST_CHECK(losses_.size() == kSizes);
  const auto samples = static_cast<double>(count_);
  const auto cost = [&](double x) { return Interpolated(losses_, x) + samples * x; };
  const double last = kFirstSize + kSizeStep * (kSizes - 1), fine = kSizeStep / kPerNode;
  double best = kFirstSize;
  for (int i = 1; i <= (kSizes - 1) * kPerNode; ++i) {
    const double x = kFirstSize + i * fine;
    if (cost(x) < cost(best)) best = x;
  }
  const double least = cost(best);
  if (std::min(cost(kFirstSize), cost(last)) < least + kVanishedDensity) return std::nullopt;
  const double curvature = (cost(best - fine) - 2 * least + cost(best + fine)) / (fine * fine);
  if (!(curvature > 0)) return std::nullopt;
  const double reach = kIntegratedReach / std::sqrt(curvature);
  const double from = std::max(kFirstSize, best - reach), to = std::min(last, best + reach);
  const double step = (to - from) / kIntegratedSteps;
  const double integral =
      LogSumExp(kIntegratedSteps + 1,
                [&](Eigen::Index i) { return -cost(from + static_cast<double>(i) * step); }) +
      std::log(step);
  const double at_best = Interpolated(curvatures_, best);
  return Value{integral - NormalizationOfAll(), at_best / precision_,
               VarianceFactor(outliers_) * at_best / curvatures_[kPresentSize]};
}

}  // namespace polyest::internal
