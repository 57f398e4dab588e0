#include "core/estimator/posterior/noise_learning.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/bayes/cost_minima.h"
#include "core/bayes/noise.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/corrected_lag1.h"
#include "core/estimator/posterior/noise_choice.h"
#include "core/estimator/problem/process_noise.h"

namespace polyest::internal {
namespace {

// A scale is not revised by less than this factor: the sums marginalize over it.
constexpr double kWorthIt = 1.25;
// As kWorthIt where outliers are handled: their part of χ², which is taken for expected, does not
// change when the sums marginalize over the scale.
constexpr double kWorthItWithOutliers = 1.1;
// Power of the ratio of χ² to what is expected by which the scale is revised, and that where
// outliers are handled: with a larger scale there are fewer outliers, so that χ² falls by less than
// the square of the scale.
constexpr double kPower = 0.5, kPowerWithOutliers = 0.75;
// Limits of a scale's change in one revision: the expansion must be able to follow.
constexpr double kMaxFall = 0.5;
constexpr double kMaxRise = 4;
// Least noise in units of the largest sample. The squares of a record with less would drown in
// rounding errors.
constexpr double kMinNoiseToSignal = 1e-9;
// If the expansion's own error makes up more than this share of χ², the scale cannot be determined.
constexpr double kMaxDiscount = 0.8;
// Factor by which a scale that is not learned yet exceeds the largest sample.
constexpr double kAboveSignal = 2;
constexpr double kSignificance = 2;  // in standard deviations, for giving up white noise
constexpr double kMinCorrelation = 0.02;
constexpr double kMaxCorrelation = 0.9999;
// Fraction of the requested change. The whole change would be right for noise of the assumed kind,
// but oscillates for other noise.
constexpr double kCorrelationStep = 0.6;
// Gain of log likelihood for which the correlation is revised: a standard deviation of log τ is
// worth ½.
constexpr double kWorthRevision = 0.25;
// Error of the linearized χ², in units of the noise's variance, from which it is linearized anew.
constexpr double kMaxNonlinearity = 0.5;
// Relative noise is taken of the predictions while the expansion's own error and the misfit (χ²/N)
// are at most these; the predictions are renewed when the minimum moves by this many posterior
// standard deviations.
constexpr double kMaxDiscountOfPrediction = 0.2;
constexpr double kMaxMisfit = 2;
constexpr double kMovedPrediction = 1;
// A noise whose log-likelihood is so much below the best one's may be left out of the grid.
constexpr double kImprobable = 4;
// Factor by which the record must exceed the grid before that is extended.
constexpr double kGridGrowth = 1.3;
// Changes from which the posterior counts as different: of its centre, in standard deviations, and
// of its spread, as a factor.
constexpr double kMoved = 0.2;
constexpr double kSpread = 1.3;

// Returns the correlation x of noise whose residuals have the lag-1 correlation r after whitening
// with a:
//   r = (x − a)(1 − a x)/(1 − 2 a x + a²).
// This is a quadratic equation in x, with the root a for r = 0. If it has no real root, the noise
// is not of this kind, and the first-order solution a + r is returned.
double CorrelationBehind(double r, double a) {
  if (a <= 0) return std::clamp(r, -kMaxCorrelation, kMaxCorrelation);
  const double b = 1 + a * a + 2 * r * a;
  const double discriminant = b * b - 4 * a * (a + r * (1 + a * a));
  const double x = discriminant < 0 ? a + r : (b - std::sqrt(discriminant)) / (2 * a);
  return std::clamp(x, -kMaxCorrelation, kMaxCorrelation);
}

class Revision {
 public:
  Revision(const ResolvedProblem& problem, const RegionalExpansion& expansion,
           const RecordSummary& record, const Matrix& particles)
      : problem_(problem),
        expansion_(expansion),
        record_(record),
        particles_(particles),
        cost_(expansion.MakeCost(problem.problem().regularization)),
        noise_(expansion.noise()) {}

  std::optional<LearnedNoise> Run(const Stop& stop) {
    if (record_.samples() == 0) return std::nullopt;
    Minimize(stop);
    for (int c = 0; c < problem_.channels(); ++c) {
      const NoiseModel& model = problem_.problem().measured[static_cast<size_t>(c)].noise;
      RevisePredicted(c, model);
      if (!model.unknown && model.correlation != NoiseCorrelation::kUnknown) continue;
      const ChannelSums& sums = expansion_.sums()[static_cast<size_t>(c)];
      if (sums.samples.count() < MinSamplesForNoise(problem_)) continue;
      // Samples that are all 0 do not tell how large their noise is.
      const bool silent = record_.channels()[static_cast<size_t>(c)].largest <= 0;
      if (model.unknown && silent) continue;
      // The channel's share of the fitted parameters.
      const double share = fitted_ * static_cast<double>(sums.samples.count()) /
                           static_cast<double>(record_.samples());
      ChannelNoise& noise = noise_.channels[static_cast<size_t>(c)];
      const bool correlated = model.correlation == NoiseCorrelation::kUnknown && MayRecorrelate(c);
      // The likelihood of other time constants is not kept of runs that have been eliminated.
      const bool weighted =
          model.outliers != OutlierHandling::kNone || problem_.ended_runs() != nullptr;
      const bool together =
          correlated && !weighted && ReviseTimeConstant(c, sums, model.unknown, noise);
      if (model.unknown && !together) ReviseScale(c, sums, share, noise);
      if (correlated && weighted) ReviseCorrelation(c, sums, noise);
      if (!noise.learned) changed_ = noise.learned = true;
    }
    if (HandlesOutliers(problem_.problem())) RevisePosterior();
    if (!changed_) return std::nullopt;
    return noise_;
  }

 private:
  void Minimize(const Stop& stop) {
    const ExpansionDesign& design = expansion_.design();
    Vector start = design.reference;
    const Vector& known = noise_.posterior.centre;
    if (known.size() > 0) start = design.region.ToLocal(known);
    eta_ =
        FindMinimaOf(cost_, SearchOf(cost_, design), WithBestParticle(start), stop).front().point;
    d_ = cost_.BasisDifference(eta_);
    to_local_ = Inverse(design.region.axes());
    fitted_ = FittedParameters(to_local_.transpose() * cost_.MismatchHessian(eta_) * to_local_,
                               problem_.prior());
  }

  // Returns the start and the particle of least cost, as rows. Where the cost has several minima,
  // the noise at one that is not the least would be too large, and the expansion's own error would
  // seem small beside it.
  Matrix WithBestParticle(const Vector& start) const {
    Matrix starts = start.transpose();
    if (particles_.rows() == 0) return starts;
    const Matrix etas = expansion_.design().region.ManyToLocal(particles_);
    Vector costs;
    cost_.EvaluateMany(etas, costs);
    Eigen::Index best = 0;
    if (!std::isfinite(costs.minCoeff(&best))) return starts;
    starts.conservativeResize(2, Eigen::NoChange);
    starts.row(1) = etas.row(best);
    return starts;
  }

  // Runs that have been eliminated stay whitened as they were until they are again. Only then does
  // the correlation left in the sums tell of the present time constant.
  bool MayRecorrelate(int c) const {
    const EndedRuns* ended = problem_.ended_runs();
    if (ended == nullptr) return true;
    const ChannelNoise& noise = noise_.channels[static_cast<size_t>(c)];
    return noise.white_share == 0 && noise.time_constant_s == ended->noise_time_constant_s[c];
  }

  // Solves Σ w u² = Degrees(). What outliers add to χ² beyond what they count is part of both
  // sides, so it is subtracted from both: it would hide how far the scale is from right.
  void ReviseScale(int c, const ChannelSums& sums, double share, ChannelNoise& noise) {
    const double discount = expansion_.Discount(c);
    if (discount > kMaxDiscount * sums.Degrees()) return;
    const double spent = sums.surplus + discount;
    const double degrees = std::max(1.0, sums.Degrees() - spent - share);
    const double chi_squared = std::max(0.0, expansion_.absorbed().ChiSquaredAt(c, d_) - spent);
    const bool weighted = IsWeighted(c);
    const double power = weighted ? kPowerWithOutliers : kPower;
    const double factor = std::clamp(std::pow(chi_squared / degrees, power), kMaxFall, kMaxRise);
    // The learned scale is not included.
    const RecordSummary::Channel& channel = record_.channels()[static_cast<size_t>(c)];
    const double least = kMinNoiseToSignal * channel.largest / channel.RootMeanSquareNoise();
    const double revised = std::max(noise.scale * factor, least);
    const double ratio = revised / noise.scale;
    const double worth_it = weighted ? kWorthItWithOutliers : kWorthIt;
    if (ratio < worth_it && ratio > 1 / worth_it) return;
    noise.scale = revised;
    changed_ = true;
  }

  // Lets relative noise be that of the predictions at the minimum, when there are samples enough
  // and the model follows them, and moves the point when the minimum has left it.
  void RevisePredicted(int c, const NoiseModel& model) {
    ChannelNoise& noise = noise_.channels[static_cast<size_t>(c)];
    if (!IsOfPrediction(model) || !problem_.problem().expansion.adaptive) return;
    if (!noise.of_prediction) {
      const ChannelSums& sums = expansion_.sums()[static_cast<size_t>(c)];
      if (sums.samples.count() < MinSamplesForNoise(problem_)) return;
      if (expansion_.Discount(c) > kMaxDiscountOfPrediction * sums.Degrees()) return;
      if (!model.unknown && expansion_.absorbed().ChiSquaredAt(c, d_) > kMaxMisfit * sums.Degrees())
        return;
    } else {
      const Vector moved = eta_ - expansion_.LinearizedAt();
      if (!(moved.dot(cost_.Hessian(eta_) * moved) > kMovedPrediction * kMovedPrediction)) return;
    }
    noise.of_prediction = true;
    noise_.centre = expansion_.design().region.ToGerm(eta_);
    changed_ = true;
  }

  // Revises the noise's correlation together with the scale; returns false when the scale is left
  // to be revised alone.
  bool ReviseTimeConstant(int c, const ChannelSums& sums, bool scale_unknown, ChannelNoise& noise) {
    const RecordSummary::Channel& channel = record_.channels()[static_cast<size_t>(c)];
    if (channel.intervals == 0) return false;
    const CorrelationProfile& profile = expansion_.Profile(c);
    if (profile.empty()) {
      SetGrid(channel, noise);
      return false;
    }
    if (expansion_.Discount(c) > kMaxDiscount * sums.Degrees()) return false;
    const Matrix unit = to_local_ * problem_.prior().GermStandardDeviation().asDiagonal();
    std::vector<CorrelationProfile::Member> members = profile.Members();
    std::vector<ProfileValue> values;
    const auto samples = static_cast<double>(sums.samples.count());
    const Matrix gram = members[CorrelationProfile::kPresent].gram;
    for (CorrelationProfile::Member& member : members) {
      member.gram /=
          sums.degrees_factor;  // so that χ² is N in the mean, with outliers' weights too
      values.push_back(EvaluateMember(member, samples, unit, scale_unknown));
    }
    const ProfileValue& present = values[CorrelationProfile::kPresent];
    LinearizeAgainIfCurved(gram, sums, present.scale);
    const NoiseChoice best = ChooseNoise(profile, values, noise.grid);
    const ProfileValue& longest = values[CorrelationProfile::kFirstMixed - 1];
    const bool may_be_longer =
        best.step == TimeConstantGrid::kSteps - 1 ||
        longest.negative_log_likelihood < best.negative_log_likelihood + kImprobable;
    ExtendGrid(best.step, may_be_longer, channel, noise);
    if (IsAbout(best.noise, noise.shape())) return false;
    if (!(best.negative_log_likelihood < present.negative_log_likelihood - kWorthRevision)) {
      return false;
    }
    noise.time_constant_s = best.noise.time_constant_s;
    noise.white_share = best.noise.white_share;
    if (scale_unknown) noise.scale *= std::clamp(best.scale, kMaxFall, kMaxRise);
    changed_ = true;
    return true;
  }

  // Revises the time constant by the correlation left at the mean interval. An outlier spoils the
  // likelihood of every other time constant, but only that of the present one has its weights.
  void ReviseCorrelation(int c, const ChannelSums& sums, ChannelNoise& noise) {
    const RecordSummary::Channel& channel = record_.channels()[static_cast<size_t>(c)];
    const auto samples = static_cast<double>(sums.samples.count());
    if (channel.intervals == 0) return;
    const double left = CorrectedLag1(cost_, expansion_, eta_).Of(c);
    const double present = channel.Correlation(noise);
    const double asked = CorrelationBehind(left, present);
    // The standard error of a correlation a is √((1 − a²)/N).
    const double significance = present > 0 ? 1 : kSignificance;
    if (std::abs(asked - present) * std::sqrt(samples / (1 - asked * asked)) < significance) return;
    const double step = present > 0 ? kCorrelationStep : 1;
    const double revised = std::min(kMaxCorrelation, present + step * (asked - present));
    // Alternating noise is not of this kind; white noise is the nearest.
    const double time_constant_s =
        revised > kMinCorrelation ? -channel.MeanInterval() / std::log(revised) : 0;
    if (std::abs(channel.Correlation({1, time_constant_s, true}) - present) < kMinCorrelation) {
      return;
    }
    noise.time_constant_s = time_constant_s;
    changed_ = true;
  }

  void SetGrid(const RecordSummary::Channel& channel, ChannelNoise& noise) {
    noise.grid = {TimeConstantGrid::kShortestInIntervals * channel.least_interval_s,
                  channel.longest_run_s};
    changed_ = true;
  }

  // Extends the grid beyond its longest time constant if that is not improbable, and beyond its
  // shortest one if that is the best, where the record now reaches farther.
  void ExtendGrid(int best, bool may_be_longer, const RecordSummary::Channel& channel,
                  ChannelNoise& noise) {
    const bool longer = channel.longest_run_s > kGridGrowth * noise.grid.longest_s;
    const bool finer = TimeConstantGrid::kShortestInIntervals * channel.least_interval_s <
                       noise.grid.shortest_s / kGridGrowth;
    if ((may_be_longer && longer) || (best <= 0 && finer)) {
      SetGrid(channel, noise);
    }
  }

  // Compares the linearized χ² at the minimum of the cost with that of the expansion.
  void LinearizeAgainIfCurved(const Matrix& gram, const ChannelSums& sums, double scale) {
    Vector delta(eta_.size() + 1);
    delta.head(eta_.size()) = eta_ - expansion_.LinearizedAt();
    delta[eta_.size()] = -1;
    const double linear = delta.dot(gram.selfadjointView<Eigen::Upper>() * delta);
    const double error = std::abs(linear - sums.samples.ChiSquared(d_));
    if (error <= kMaxNonlinearity * scale * scale) return;
    noise_.centre = expansion_.design().region.ToGerm(eta_);
    changed_ = true;
  }

  bool IsWeighted(int c) const {
    const NoiseModel& model = problem_.problem().measured[static_cast<size_t>(c)].noise;
    return model.outliers != OutlierHandling::kNone;
  }

  // Revises the posterior's centre and covariance from the curvature. The covariance is limited to
  // the prior's in every direction.
  void RevisePosterior() {
    const Vector unit = problem_.prior().GermStandardDeviation();
    const Matrix hessian = to_local_.transpose() * cost_.Hessian(eta_) * to_local_;
    const Matrix scaled = unit.asDiagonal() * hessian * unit.asDiagonal();
    if (!scaled.allFinite()) return;
    const SymmetricEigen eigen = DecomposeSymmetric(scaled);
    const Vector deviation = eigen.values.cwiseMax(1).cwiseSqrt().cwiseInverse();
    PosteriorSummary present;
    present.centre = expansion_.design().region.ToGerm(eta_);
    present.factor = unit.asDiagonal() * eigen.vectors * deviation.asDiagonal();
    PosteriorSummary& before = noise_.posterior;
    if (before.centre.size() > 0) {
      const Matrix inverse = Inverse(present.factor);
      const double moved = (inverse * (present.centre - before.centre)).norm();
      const double spread = (inverse * before.factor).norm() / std::sqrt(deviation.size());
      if (moved < kMoved && spread < kSpread && spread > 1 / kSpread) return;
    }
    before = std::move(present);
    changed_ = true;
  }

  const ResolvedProblem& problem_;
  const RegionalExpansion& expansion_;
  const RecordSummary& record_;
  const Matrix& particles_;
  const Cost cost_;
  LearnedNoise noise_;
  Vector eta_, d_;
  Matrix to_local_;  // axes⁻¹
  double fitted_ = 0;
  bool changed_ = false;
};

}  // namespace

int64_t MinSamplesForNoise(const ResolvedProblem& problem) {
  const EndedRuns* ended = problem.ended_runs();
  const int64_t of_ended = ended == nullptr ? 0 : ended->own_parameters() * std::ssize(ended->run);
  return MinSamplesForNoise(problem.dimension() + of_ended);
}

std::optional<double> UnlearnedScale(const RecordSummary& record, size_t channel, double value,
                                     double predicted, double present) {
  const bool first = record.channels().empty() || record.channels()[channel].samples == 0;
  const bool silent = first || record.channels()[channel].largest == 0;
  const double size = value == 0 && silent ? predicted : value;
  const double scale = kAboveSignal * size;
  // Whether the scale is to be that of this sample, and is not yet.
  const bool begins =
      size > 0 && (first || (silent && value > 0)) && std::abs(present - scale) > 0.1 * size;
  if (!begins && size <= present) return std::nullopt;
  return scale;
}

// Filters handle outliers without the posterior, and learn no other noise.
bool LearnsNoise(const Problem& problem) {
  if (UsesFilters(problem)) return false;
  return std::ranges::any_of(problem.measured, [&problem](const MeasuredOutput& m) {
    return IsLearned(m.noise) || (problem.expansion.adaptive && IsOfPrediction(m.noise));
  });
}

bool HandlesOutliers(const Problem& problem) {
  return std::ranges::any_of(problem.measured, [](const MeasuredOutput& m) {
    return m.noise.outliers != OutlierHandling::kNone;
  });
}

std::optional<LearnedNoise> ReviseNoise(const ResolvedProblem& problem,
                                        const RegionalExpansion& expansion,
                                        const RecordSummary& record, const Matrix& particles,
                                        const Stop& stop) {
  return Revision(problem, expansion, record, particles).Run(stop);
}

double FittedParameters(const ConstMatrixRef& mismatch_hessian, const Prior& prior) {
  const Vector unit = prior.GermStandardDeviation();
  const Matrix scaled = unit.asDiagonal() * mismatch_hessian * unit.asDiagonal();
  if (!scaled.allFinite()) return 0;
  const Vector information = SymmetricEigenvalues(scaled).cwiseMax(0);
  return information.cwiseQuotient((information.array() + 1).matrix()).sum();
}

}  // namespace polyest::internal
