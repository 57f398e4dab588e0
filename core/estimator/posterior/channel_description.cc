#include "core/estimator/posterior/channel_description.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/bayes/mismatch.h"
#include "core/bayes/noise.h"
#include "core/estimator/posterior/corrected_lag1.h"
#include "core/estimator/posterior/independent_share.h"
#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/posterior/residual_tests.h"
#include "core/estimator/problem/settable_quantities.h"

namespace polyest::internal {
namespace {

constexpr Eigen::Index kDrawsForNoise = 200;
constexpr int64_t kMinSums = 8;  // of successive residuals
constexpr double kAlike = 1.5;   // largest ratio of mean squares that are much the same

// Returns E[χ²] of a channel over the posterior; E[σ²] = E[χ²]/N for an unknown scale.
double MeanChiSquared(const Cost& cost, const RegionalExpansion& expansion, int c,
                      const PosteriorDraws& posterior) {
  const Eigen::Index stride = std::max<Eigen::Index>(1, posterior.scores.rows() / kDrawsForNoise);
  double sum = 0, weights = 0;
  for (Eigen::Index i = 0; i < posterior.scores.rows(); i += stride) {
    const Vector xi = cost.prior().OfScores(posterior.scores.row(i).transpose());
    const double weight = posterior.weights[i];
    sum += weight *
           expansion.absorbed().ChiSquaredAt(c, cost.BasisDifference(cost.region().ToLocal(xi)));
    weights += weight;
  }
  return sum / weights;
}

// Describes the sums of successive residuals, if there are enough and the linearized model, of
// which they are, has residuals as large as the expansion's own. Outliers, weighed less one by one,
// leave whitened residuals that do not cancel.
void DescribeSums(const AssessmentRequest& request, const Vector& eta, const Vector& d, int c,
                  ChannelEstimate& channel) {
  const RegionalExpansion& expansion = *request.expansion;
  const NoiseModel& model = request.problem->problem().measured[static_cast<size_t>(c)].noise;
  const ResidualBlocks& blocks = expansion.Blocks(c);
  if (blocks.count() < kMinSums || model.outliers != OutlierHandling::kNone) return;
  const ChannelSums& sums = expansion.sums()[static_cast<size_t>(c)];
  const Vector delta = eta - expansion.LinearizedAt();
  const double of_all = sums.samples.ChiSquared(d) / static_cast<double>(sums.samples.count());
  const double ratio = blocks.MeanSquare(delta) / of_all;
  if (!(ratio > 1 / kAlike && ratio < kAlike)) return;
  // An error of the linearization that lasts for a whole block adds kLength times its mean square
  // to the variance ratio. So much is taken off, because it says nothing of the noise.
  const double by_linearization = ResidualBlocks::kLength * std::abs(ratio - 1);
  channel.variance_ratio = std::max(0.0, ratio * blocks.VarianceRatio(delta) - by_linearization);
  channel.residual_sums = blocks.count();
}

// What of a channel's χ² belongs to outliers, in the units of its sums.
struct Outliers {
  int64_t count = 0;
  double chi_squared = 0;  // of all samples
  double of_outliers = 0;
};

// Returns the outliers at the estimate if the samples are kept, or else as they were when they got
// their weights. `chi_squared` is that of the sums at d, for the noise as it is taken to be.
Outliers OutliersAt(const RegionalExpansion& expansion, OutlierHandling handling, const Vector& d,
                    int c, double chi_squared) {
  if (const RobustSamples* kept = expansion.absorbed().KeptSamples(c)) {
    const RobustSamples::Judgement judged = kept->JudgedAt(d);
    const double unit = VarianceFactor(handling);
    return {judged.outliers, judged.chi_squared / unit, judged.of_outliers / unit};
  }
  const int64_t count = expansion.Outliers(c);
  const ChannelSums& sums = expansion.sums()[static_cast<size_t>(c)];
  return {count, chi_squared, sums.surplus + OutlierDegrees(handling) * static_cast<double>(count)};
}

// Returns χ² in units in which N is expected. Outliers count as one each, as long as they may be
// gross errors, of which neither model nor noise knows; else for what they are. `used` are the
// degrees of freedom used up.
double JudgedChiSquared(const AssessmentRequest& request, int c, const Outliers& found,
                        double used) {
  const ChannelSums& sums = request.expansion->sums()[static_cast<size_t>(c)];
  const OutlierHandling handling =
      request.problem->problem().measured[static_cast<size_t>(c)].noise.outliers;
  const bool weighted = handling != OutlierHandling::kNone && !request.problem->uses_filters();
  if (!weighted || sums.scale_unknown) {
    return (found.chi_squared - sums.surplus) / sums.degrees_factor;
  }
  const auto outliers = static_cast<double>(found.count);
  const auto samples = static_cast<double>(sums.samples.count());
  const double others = (found.chi_squared - found.of_outliers) / InlierDegreesFactor(handling);
  return MayBeGrossErrors(handling, outliers / samples, others, samples - outliers - used)
             ? others + outliers
             : found.chi_squared / DegreesFactor(handling);
}

void DescribeChannel(const AssessmentRequest& request, const Cost& cost, const Vector& eta,
                     const Vector& d, const PosteriorDraws& posterior, const CorrectedLag1& lag1,
                     double fitted, int c, ChannelEstimate& channel) {
  const RecordSummary::Channel& summary = request.record->channels()[static_cast<size_t>(c)];
  const ChannelSums& sums = request.expansion->sums()[static_cast<size_t>(c)];
  const ChannelNoise& noise = request.expansion->noise().channels[static_cast<size_t>(c)];
  channel.samples = summary.samples;
  if (summary.samples == 0) return;
  const auto samples = static_cast<double>(summary.samples);
  // With N degrees of freedom, χ²/N has the mean 1 if the working noise has the right size.
  const double mean_square =
      sums.scale_unknown
          ? std::max(kMinMeanSquare,
                     MeanChiSquared(cost, *request.expansion, c, posterior) / sums.Degrees())
          : 1;
  channel.noise_std_dev = std::sqrt(mean_square) * noise.scale * summary.RootMeanSquareNoise();
  const double share =
      fitted * samples / static_cast<double>(request.record->samples()) + sums.spent;
  const OutlierHandling handling =
      request.problem->problem().measured[static_cast<size_t>(c)].noise.outliers;
  const Outliers outliers =
      OutliersAt(*request.expansion, handling, d, c,
                 request.expansion->absorbed().ChiSquaredAt(c, d) / mean_square);
  channel.chi_squared = JudgedChiSquared(request, c, outliers, share);
  channel.lag1_correlation = lag1.Of(c);
  DescribeSums(request, eta, d, c, channel);
  channel.noise_time_constant_s = noise.time_constant_s;
  channel.noise_white_share = noise.white_share;
  channel.outliers = outliers.count;
  channel.effective_samples =
      samples * (noise.time_constant_s > 0
                     ? IndependentShare(request.record->beginning(), c, noise.shape())
                     : 1 / VarianceOfMeans(channel));
}

// Returns the uncertain parameter that is the output's noise, if there is one.
std::optional<Eigen::Index> UncertainNoise(const Prior& prior, const std::string& output) {
  const std::vector<std::string> names = prior.Names();
  const auto found = std::ranges::find(names, NoiseName(output));
  if (found == names.end()) return std::nullopt;
  return found - names.begin();
}

}  // namespace

std::vector<ChannelEstimate> DescribeChannels(const AssessmentRequest& request, const Cost& cost,
                                              const Vector& eta, const PosteriorDraws& posterior,
                                              double fitted) {
  const Vector d = cost.BasisDifference(eta);
  const CorrectedLag1 lag1(cost, *request.expansion, eta);
  std::vector<ChannelEstimate> channels;
  for (int c = 0; c < request.problem->channels(); ++c) {
    ChannelEstimate channel;
    channel.output = request.problem->problem().measured[static_cast<size_t>(c)].output;
    if (!request.record->channels().empty()) {
      DescribeChannel(request, cost, eta, d, posterior, lag1, fitted, c, channel);
    }
    const std::map<std::string, double>& fixed = request.problem->problem().fixed;
    if (const auto noise = fixed.find(NoiseName(channel.output)); noise != fixed.end()) {
      channel.noise_std_dev = noise->second;
    }
    if (const auto i = UncertainNoise(cost.prior(), channel.output)) {
      channel.noise_std_dev = cost.prior().ToParameters(cost.region().ToGerm(eta))[*i];
    }
    channels.push_back(std::move(channel));
  }
  return channels;
}

std::vector<double> DegreesOfFreedom(const AssessmentRequest& request,
                                     const std::vector<ChannelEstimate>& channels, double fitted) {
  const auto all = static_cast<double>(std::max<int64_t>(1, request.record->samples()));
  std::vector<double> degrees;
  for (size_t c = 0; c < channels.size(); ++c) {
    const auto samples = static_cast<double>(channels[c].samples);
    const ChannelSums& sums = request.expansion->sums()[c];
    const double used = fitted * samples / all + sums.spent / sums.degrees_factor;
    degrees.push_back(std::max(0.0, samples - used));
  }
  return degrees;
}

}  // namespace polyest::internal
