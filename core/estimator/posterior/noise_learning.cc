#include "core/estimator/posterior/noise_learning.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/noise.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/search_domain.h"

namespace polyest::internal {
namespace {

// A scale is not revised by less than this factor: the sums marginalize over it.
constexpr double kWorthIt = 1.25;
// Limits of a scale's change in one revision: the expansion must be able to follow.
constexpr double kMaxFall = 0.5;
constexpr double kMaxRise = 4;
// If the expansion's own error makes up more than this share of χ², the scale cannot be determined.
constexpr double kMaxDiscount = 0.8;
constexpr double kSignificance = 2;  // in standard deviations, for giving up white noise
constexpr double kMinCorrelation = 0.02;
constexpr double kMaxCorrelation = 0.9999;
// Fraction of the requested change. The whole change would be right for noise of the assumed kind,
// but oscillates for other noise.
constexpr double kCorrelationStep = 0.6;
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
           const RecordSummary& record)
      : problem_(problem),
        expansion_(expansion),
        record_(record),
        cost_(expansion.MakeCost(problem.problem().regularization)),
        noise_(expansion.noise()) {}

  std::optional<LearnedNoise> Run(const Stop& stop) {
    if (record_.samples() == 0) return std::nullopt;
    Minimize(stop);
    for (int c = 0; c < problem_.channels(); ++c) {
      const NoiseModel& model = problem_.problem().measured[static_cast<size_t>(c)].noise;
      if (!model.unknown && model.correlation != NoiseCorrelation::kUnknown) continue;
      const ChannelSums& sums = expansion_.sums()[static_cast<size_t>(c)];
      if (sums.samples.count() < kMinSamplesForNoise + 4 * problem_.dimension()) continue;
      // The channel's share of the fitted parameters.
      const double share = fitted_ * static_cast<double>(sums.samples.count()) /
                           static_cast<double>(record_.samples());
      ChannelNoise& noise = noise_.channels[static_cast<size_t>(c)];
      if (model.unknown) ReviseScale(c, sums, share, noise);
      if (model.correlation == NoiseCorrelation::kUnknown) ReviseCorrelation(c, sums, share, noise);
      if (!noise.learned) changed_ = noise.learned = true;
    }
    if (HandlesOutliers()) RevisePosterior();
    if (!changed_) return std::nullopt;
    return noise_;
  }

 private:
  void Minimize(const Stop& stop) {
    const ExpansionDesign& design = expansion_.design();
    Vector start = design.reference;
    const Vector& known = noise_.posterior.centre;
    if (known.size() > 0) start = design.region.ToLocal(known);
    eta_ = FindMinima(SearchOf(cost_, design), start.transpose(), MinimizerOptions(), stop)
               .front()
               .point;
    d_ = cost_.BasisDifference(eta_);
    to_local_ = Inverse(design.region.axes());
    fitted_ = FittedParameters(to_local_.transpose() * cost_.MismatchHessian(eta_) * to_local_,
                               problem_.prior());
  }

  void ReviseScale(int c, const ChannelSums& sums, double share, ChannelNoise& noise) {
    const double discount = expansion_.Discount(c);
    if (discount > kMaxDiscount * sums.Degrees()) return;
    const double degrees = std::max(1.0, sums.Degrees() - discount - share);
    const double chi_squared = std::max(0.0, sums.samples.ChiSquared(d_) - discount);
    const double factor = std::clamp(std::sqrt(chi_squared / degrees), kMaxFall, kMaxRise);
    // The learned scale is not included.
    const double typical = record_.channels()[static_cast<size_t>(c)].RootMeanSquareNoise();
    const double revised =
        std::max(noise.scale * factor, NoiseModel::kMinStandardDeviation / typical);
    const double ratio = revised / noise.scale;
    if (ratio < kWorthIt && ratio > 1 / kWorthIt) return;
    noise.scale = revised;
    changed_ = true;
  }

  void ReviseCorrelation(int c, const ChannelSums& sums, double share, ChannelNoise& noise) {
    const RecordSummary::Channel& channel = record_.channels()[static_cast<size_t>(c)];
    const auto samples = static_cast<double>(sums.samples.count());
    if (channel.intervals == 0) return;
    const double left = sums.Lag1Correlation(d_) + Lag1Correction(share, samples);
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

  bool HandlesOutliers() const {
    return std::ranges::any_of(problem_.problem().measured, [](const MeasuredOutput& measured) {
      return measured.noise.outliers != OutlierHandling::kNone;
    });
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
  const Cost cost_;
  LearnedNoise noise_;
  Vector eta_, d_;
  Matrix to_local_;  // axes⁻¹
  double fitted_ = 0;
  bool changed_ = false;
};

}  // namespace

LearnedNoise NoiseToBeginWith(const Problem& problem) {
  LearnedNoise noise;
  for (const MeasuredOutput& measured : problem.measured) {
    ChannelNoise channel;
    if (measured.noise.unknown) channel.scale = NoiseModel::kMinStandardDeviation;
    channel.time_constant_s = measured.noise.time_constant_s;
    noise.channels.push_back(channel);
  }
  return noise;
}

bool LearnsNoise(const Problem& problem) {
  return std::ranges::any_of(problem.measured,
                             [](const MeasuredOutput& m) { return IsLearned(m.noise); });
}

std::optional<LearnedNoise> ReviseNoise(const ResolvedProblem& problem,
                                        const RegionalExpansion& expansion,
                                        const RecordSummary& record, const Stop& stop) {
  return Revision(problem, expansion, record).Run(stop);
}

double FittedParameters(const ConstMatrixRef& mismatch_hessian, const Prior& prior) {
  const Vector unit = prior.GermStandardDeviation();
  const Matrix scaled = unit.asDiagonal() * mismatch_hessian * unit.asDiagonal();
  if (!scaled.allFinite()) return 0;
  const Vector information = SymmetricEigenvalues(scaled).cwiseMax(0);
  return information.cwiseQuotient((information.array() + 1).matrix()).sum();
}

}  // namespace polyest::internal
