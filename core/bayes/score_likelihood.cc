#include "core/bayes/score_likelihood.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/chaos/normal.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr double kFloor = 300;  // below the largest log L
// Difference of four neighbours from which on the likelihood is not smooth but ends there.
constexpr double kMaxCurved = 20;
constexpr double kFarthest = 9;          // score, beyond which there is no posterior
constexpr double kGaussianReach = 4;     // standard deviations
constexpr double kGaussianError = 1e-3;  // of the logarithm of the density
constexpr double kDistance = 0.25;       // of components, standard deviations
constexpr double kMixtureReach = 5;      // standard deviations, of the posterior and of the prior
constexpr double kNegligibleLog = 15;    // below the largest log L
constexpr int kIterations = 100;
constexpr int kIntervals = 1'000;       // of the trapezoidal rule
constexpr double kPopulationReach = 9;  // standard deviations

// Returns the logarithm of the integral over equidistant nodes of e^{values}.
double LogTrapezoid(const Eigen::ArrayXd& values, double step) {
  const double greatest = values.maxCoeff();
  if (!std::isfinite(greatest)) return -kInfinity;
  return greatest + std::log(step * (values - greatest).exp().sum());
}

}  // namespace

ScoreLikelihood::ScoreLikelihood(double first, double step, Vector log_likelihood)
    : first_(first), step_(step), log_(std::move(log_likelihood)) {
  POLYEST_CHECK(log_.size() >= 4 && step > 0);
  greatest_ = -kInfinity;
  for (const double value : log_) {
    if (std::isfinite(value)) greatest_ = std::max(greatest_, value);
  }
  if (!std::isfinite(greatest_)) greatest_ = 0;
  for (double& value : log_) {
    value = std::isfinite(value) ? std::max(value, greatest_ - kFloor) : greatest_ - kFloor;
  }
  // The grid spans about 8 standard deviations; the posterior may go on beyond it.
  const double last = first_ + step_ * static_cast<double>(log_.size() - 1), span = last - first_;
  const double lower = std::max(first_ - span, std::min(first_, -kFarthest));
  const double upper = std::min(last + span, std::max(last, kFarthest));
  const double fine = std::min(step_ / 4, (upper - lower) / kIntervals);
  const auto count = static_cast<Eigen::Index>((upper - lower) / fine) + 1;
  Eigen::ArrayXd at(count), values(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    at[i] = lower + fine * static_cast<double>(i);
    values[i] = LogAt(at[i]) - 0.5 * at[i] * at[i];
  }
  log_evidence_ = LogTrapezoid(values, fine);
  const Eigen::ArrayXd density = fine * (values - log_evidence_).exp();
  posterior_.mean = (density * at).sum();
  posterior_.variance = (density * (at - posterior_.mean).square()).sum();
}

double ScoreLikelihood::LogAt(double g) const {
  const Eigen::Index last = log_.size() - 1;
  const double place = (g - first_) / step_;
  const bool below = place < 0;
  if (below || place >= static_cast<double>(last)) {
    // Outwards from the end at which g lies.
    const Eigen::Index end = below ? 0 : last, inner = below ? 1 : -1;
    const double e = log_[end], e1 = log_[end + inner], e2 = log_[end + 2 * inner];
    const double distance = below ? -place : place - static_cast<double>(last);
    const double curvature = std::min(0.0, e - 2 * e1 + e2);
    const double slope = std::min(0.0, 1.5 * e - 2 * e1 + 0.5 * e2);
    return e + distance * (slope + 0.5 * distance * curvature);
  }
  // Lagrange's cubic through four nodes, or a line where it would overshoot.
  const auto left = std::min(static_cast<Eigen::Index>(place), last - 1);
  const auto at = std::clamp<Eigen::Index>(left - 1, 0, last - 3);
  const auto four = log_.segment(at, 4);
  if (four.maxCoeff() - four.minCoeff() > kMaxCurved) {
    return log_[left] + (place - static_cast<double>(left)) * (log_[left + 1] - log_[left]);
  }
  const double x = place - static_cast<double>(at);
  return log_[at] * (x - 1) * (x - 2) * (x - 3) / -6 + log_[at + 1] * x * (x - 2) * (x - 3) / 2 +
         log_[at + 2] * x * (x - 1) * (x - 3) / -2 + log_[at + 3] * x * (x - 1) * (x - 2) / 6;
}

double ScoreLikelihood::NegativeLogEvidence(const RunScore& population) const {
  const double deviation = std::sqrt(population.variance);
  double lower = population.mean - kPopulationReach * deviation;
  double upper = population.mean + kPopulationReach * deviation;
  // A precise run is far narrower than the population.
  const double own = 3 * kPopulationReach * std::sqrt(posterior_.variance);
  if (posterior_.mean - own < upper) lower = std::max(lower, posterior_.mean - own);
  if (posterior_.mean + own > lower) upper = std::min(upper, posterior_.mean + own);
  const double step = (upper - lower) / kIntervals;
  Eigen::ArrayXd values(kIntervals + 1);
  for (Eigen::Index i = 0; i <= kIntervals; ++i) {
    const double g = lower + step * static_cast<double>(i);
    const double u = (g - population.mean) / deviation;
    values[i] = LogAt(g) - 0.5 * u * u;
  }
  return std::log(deviation) + 0.5 * kLogTwoPi - LogTrapezoid(values, step);
}

bool ScoreLikelihood::IsGaussian() const {
  const double deviation = std::sqrt(posterior_.variance);
  const double constant = -0.5 * std::log(2 * std::numbers::pi * posterior_.variance);
  for (double u = -kGaussianReach; u <= kGaussianReach; u += 0.25) {
    const double error = LogPosterior(posterior_.mean + u * deviation) - constant + 0.5 * u * u;
    if (!(std::abs(error) < kGaussianError)) return false;
  }
  return true;
}

// The centres go on where the likelihood has not fallen, as far as the prior reaches: a population
// that is wider than the prior, or elsewhere, looks there.
Vector ScoreLikelihood::Centres() const {
  const double deviation = std::sqrt(posterior_.variance), mean = posterior_.mean;
  const auto reach = [&](double direction) {
    double g = mean;
    const auto goes_on = [&] {
      const bool near =
          std::abs(g - mean) < kMixtureReach * deviation || direction * g < kMixtureReach;
      return near && LogAt(g) > greatest_ - kNegligibleLog;
    };
    while (goes_on()) g += direction * kDistance * deviation;
    return g;
  };
  const double lower = reach(-1), upper = reach(1);
  const auto wanted = std::lround((upper - lower) / (kDistance * deviation)) + 1;
  return Vector::LinSpaced(std::clamp<Eigen::Index>(wanted, 4, ScoreMixture::kMaxComponents), lower,
                           upper);
}

ScoreMixture ScoreLikelihood::Mixture() const {
  ScoreMixture mixture;
  if (IsGaussian()) return mixture;
  const Vector centres = Centres();
  const Eigen::Index count = centres.size();
  mixture.first = centres[0] - posterior_.mean;
  mixture.step = centres[1] - centres[0];
  // The iteration compares at the centres and half way between them.
  const Vector places = Vector::LinSpaced(2 * count - 1, centres[0], centres[count - 1]);
  const Vector density = places.unaryExpr([this](double g) { return std::exp(LogPosterior(g)); });
  Matrix kernel(places.size(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    kernel.col(k) = (-0.5 * ((places.array() - centres[k]) / mixture.step).square()).exp();
  }
  const Matrix averages = kernel * kernel.colwise().sum().cwiseInverse().asDiagonal();
  kernel /= std::sqrt(2 * std::numbers::pi) * mixture.step;
  const auto half = Eigen::seqN(0, count, 2);
  Vector weights = mixture.step * density(half);
  for (int i = 0; i < kIterations; ++i) {
    const Vector ratio = density.cwiseQuotient(kernel * weights);
    weights.array() *= (averages.transpose() * ratio).array();
  }
  mixture.log_weights = (weights / weights.sum()).array().max(1e-300).log();
  return mixture;
}

}  // namespace polyest::internal
