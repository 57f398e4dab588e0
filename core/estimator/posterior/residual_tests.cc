#include "core/estimator/posterior/residual_tests.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/chi_squared.h"

namespace polyest::internal {
namespace {

constexpr double kExcessDeviations = 6;
constexpr double kExcessRatio = 1.2;
constexpr double kExcessRatioWithOutliers = 1.5;
constexpr double kExcessRatioWithTails = 2;
constexpr double kTooSmallRatio = 1.5;
constexpr double kTooSmallRatioWithTails = 2.5;
constexpr double kMaxShareForStudentT = 1.0 / 3;
constexpr double kMaxShareForHuber = 0.15;
constexpr double kDeviationsOfOthers = 4;
// √(Var[w u²]/E[w u²]²) of samples that are no outliers: 1.00 for Student's t, 1.08 for Huber.
constexpr double kDeviationOfOthers = 1.1;
constexpr double kCorrelationDeviations = 4;
constexpr double kCorrelated = 0.05;
constexpr double kSlowlyCorrelated = 1.5;
constexpr int64_t kMinForCorrelation = 20;
constexpr double kMaxLag1Correlation = 0.99;

}  // namespace

double ExcessRatio(OutlierHandling outliers, bool filtered) {
  if (outliers == OutlierHandling::kNone) return kExcessRatio;
  return filtered ? kExcessRatioWithTails : kExcessRatioWithOutliers;
}

double TooSmallRatio(OutlierHandling outliers, bool filtered) {
  return filtered && outliers != OutlierHandling::kNone ? kTooSmallRatioWithTails : kTooSmallRatio;
}

bool ExceedsNoise(const ChannelEstimate& channel, double degrees, OutlierHandling outliers,
                  bool filtered) {
  const auto samples = static_cast<double>(channel.samples);
  if (!(channel.chi_squared > ExcessRatio(outliers, filtered) * degrees)) return false;
  return channel.chi_squared > degrees + kExcessDeviations * std::sqrt(2 * samples) ||
         NormalDeviateOfChiSquared(channel.chi_squared, std::max(1.0, degrees)) > kExcessDeviations;
}

bool MayBeGrossErrors(OutlierHandling outliers, double share, double chi_squared_of_others,
                      double degrees) {
  const bool huber = outliers == OutlierHandling::kHuber;
  if (share > (huber ? kMaxShareForHuber : kMaxShareForStudentT)) return false;
  const double expected = std::max(1.0, degrees);
  const double deviation = kDeviationOfOthers * std::sqrt(expected);
  return chi_squared_of_others <=
         std::max(kExcessRatio * expected, expected + kDeviationsOfOthers * deviation);
}

double ResidualToNoise(const ChannelEstimate& channel, double degrees) {
  return std::sqrt(channel.chi_squared / std::max(1.0, degrees));
}

bool AreCorrelated(const ChannelEstimate& channel, int64_t runs) {
  if (channel.samples < kMinForCorrelation) return false;
  const auto samples = static_cast<double>(channel.samples);
  const double by_chance = std::max(kCorrelated, kCorrelationDeviations / std::sqrt(samples)) +
                           static_cast<double>(runs) / (2 * samples);
  return std::abs(channel.lag1_correlation) > by_chance;
}

bool AreSlowlyCorrelated(const ChannelEstimate& channel) {
  if (channel.variance_ratio < kSlowlyCorrelated) return false;
  const auto sums = static_cast<double>(channel.residual_sums);
  return NormalDeviateOfChiSquared(channel.variance_ratio * sums, sums) > kCorrelationDeviations;
}

double VarianceOfMeans(const ChannelEstimate& channel) {
  const double r = std::clamp(channel.lag1_correlation, 0.0, kMaxLag1Correlation);
  const double ratio = (1 + r) / (1 - r);
  return AreSlowlyCorrelated(channel) ? std::max(ratio, channel.variance_ratio) : ratio;
}

double Dispersion(const ChannelEstimate& channel, double degrees, bool noise_known) {
  if (channel.samples == 0) return 1;
  const double ratio = noise_known ? ResidualToNoise(channel, degrees) : 1;
  return std::max(1.0, ratio * ratio) * VarianceOfMeans(channel);
}

}  // namespace polyest::internal
