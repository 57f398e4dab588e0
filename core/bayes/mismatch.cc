#include "core/bayes/mismatch.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>

#include "core/bayes/factored_sums.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr double kMaxCorrelation = 1 - 1e-12;

// The J of a channel as a function of A = χ² and D = Σ (u_k − u_{k−1})², and its derivatives; B = A
// − D/2 and r = B/A.
struct Likelihood {
  double value = 0;
  double by_a = 0, by_d = 0;
  double by_aa = 0, by_ad = 0, by_dd = 0;
};

double LagCorrelation(double a, double d) {
  return a > 0 ? std::clamp(1 - 0.5 * d / a, -kMaxCorrelation, kMaxCorrelation) : 0;
}

// Adds what an unknown correlation between neighbouring samples adds, ½ (N − 1) log(1 − r²) with an
// unknown scale and else −½ A r² = −½ B²/A, B = A − D/2.
void AddCorrelation(double n, double a, double d, bool scale_unknown, Likelihood& l) {
  const double r = LagCorrelation(a, d);
  if (!scale_unknown) {
    const double b = a * r;
    l.value -= 0.5 * b * r;
    l.by_a += -r + 0.5 * r * r;  // ∂B/∂A = 1
    l.by_d += 0.5 * r;           // ∂B/∂D = −½
    // The second derivatives of −½ B²/A are those of −½ (A − D + D²/4A).
    l.by_aa += -0.25 * d * d / (a * a * a);
    l.by_ad += 0.25 * d / (a * a);
    l.by_dd += -0.25 / a;
    return;
  }
  const double r_a = 0.5 * d / (a * a), r_d = -0.5 / a;
  const double m = 0.5 * (n - 1), s = 1 - r * r;
  const double by_r = -2 * m * r / s, by_rr = -2 * m * (1 + r * r) / (s * s);
  l.value += m * std::log(s);
  l.by_a += by_r * r_a;
  l.by_d += by_r * r_d;
  l.by_aa += by_rr * r_a * r_a - by_r * d / (a * a * a);
  l.by_ad += by_rr * r_a * r_d + 0.5 * by_r / (a * a);
  l.by_dd += by_rr * r_d * r_d;
}

Likelihood Evaluate(double n, double chi_squared, double differences, bool scale_unknown,
                    bool correlation_unknown) {
  Likelihood l;
  if (n <= 0) return l;
  if (!scale_unknown && !correlation_unknown) {
    l.value = 0.5 * chi_squared;  // below 0 where it stands for χ² + Σ log(S_k/R_k)
    l.by_a = 0.5;
    return l;
  }
  const double a = std::max(chi_squared, n * kMinMeanSquare);
  if (scale_unknown) {
    // ½ N (1 + log(A/N))
    l.value = 0.5 * n * (1 + std::log(a / n));
    l.by_a = 0.5 * n / a;
    l.by_aa = -0.5 * n / (a * a);
  } else {
    l.value = 0.5 * a;
    l.by_a = 0.5;
  }
  if (correlation_unknown) AddCorrelation(n, a, differences, scale_unknown, l);
  return l;
}

// Evaluates a channel; `factor` multiplies N and accounts for the degrees of freedom that
// parameters have spent.
Likelihood Evaluate(const ChannelSums& channel, double chi_squared, double differences,
                    double factor = 1) {
  return Evaluate(factor * channel.Degrees(), chi_squared, differences, channel.scale_unknown,
                  channel.correlation_unknown);
}

}  // namespace

double NegativeLogLikelihood(double degrees, double chi_squared, double differences,
                             bool scale_unknown, bool correlation_unknown) {
  return Evaluate(degrees, chi_squared, differences, scale_unknown, correlation_unknown).value;
}

double ChannelSums::Weight(const ConstVectorRef& d) const {
  if (!scale_unknown) return 1;
  const double chi_squared = samples.ChiSquared(d);
  return chi_squared > 0 ? Degrees() / chi_squared : 1;
}

double ChannelSums::Lag1Correlation(const ConstVectorRef& d) const {
  return samples.count() == 0 ? 0
                              : LagCorrelation(samples.ChiSquared(d), differences.ChiSquared(d));
}

// It is χ² + L with known noise, and χ² e^{L/N} with an unknown scale.
double ChannelSums::WithLogVariance(double chi_squared, double logs) const {
  if (!scale_unknown) return chi_squared + logs;
  const double degrees = Degrees();
  return degrees > 0 ? chi_squared * std::exp(logs / degrees) : chi_squared;
}

struct Mismatch::Sums {
  // A channel whose noise is not known. What is factored of it points to its sums.
  struct Channel {
    explicit Channel(const ChannelSums& channel_sums)
        : sums(channel_sums), samples(&sums.samples, true), differences(&sums.differences, true) {}

    ChannelSums sums;
    FactoredSums samples;
    FactoredSums differences;
  };

  // A channel of relative noise while its samples are few.
  struct Relative {
    double degrees = 0;
    bool scale_unknown = false;
    RelativeSamples samples;

    // Returns the likelihood as a function of A; ½ L is to be added. For `factor` see Evaluate.
    Likelihood Of(double chi_squared, double factor = 1) const {
      return polyest::internal::Evaluate(factor * degrees, chi_squared, 0, scale_unknown, false);
    }
  };

  explicit Sums(MismatchSums all_known) : known(std::move(all_known)), count(known.count()) {}

  // Whether `known` has samples; without, it is 0 everywhere.
  bool has_known() const { return known.count() > 0; }

  MismatchSums known;  // of all channels with known noise
  FactoredSums factored_known{&known, false};
  // Their ½ Σ log(S_k/R_k) = lᵀd + lᵀφ_0, which may be below 0: l (S; empty if it is 0), and lᵀφ_0.
  Vector log_variance;
  double log_variance_at_reference = 0;
  std::deque<Channel> others;
  std::vector<RobustSamples> kept;  // of channels with outliers while their samples are few
  std::vector<Relative> relative;
  int64_t count = 0;  // of samples, over all channels
};

Mismatch::Mismatch(MismatchSums known) {
  auto sums = std::make_shared<Sums>(std::move(known));
  sums->known.Complete();
  sums_ = std::move(sums);
}

Mismatch::Mismatch(const std::vector<ChannelSums>& channels, const std::vector<RobustSamples>& kept,
                   const std::vector<RelativeSamples>& relative) {
  POLYEST_CHECK(!channels.empty() && (kept.empty() || kept.size() == channels.size()));
  POLYEST_CHECK(relative.empty() || relative.size() == channels.size());
  auto sums = std::make_shared<Sums>(MismatchSums(channels.front().samples.terms()));
  for (size_t c = 0; c < channels.size(); ++c) {
    const ChannelSums& channel = channels[c];
    sums->count += channel.samples.count();
    if (!kept.empty() && kept[c].outliers() != OutlierHandling::kNone) {
      POLYEST_CHECK(channel.IsKnown());
      sums->kept.push_back(kept[c]);
      continue;
    }
    if (!relative.empty() && relative[c].keeps()) {
      POLYEST_CHECK(!channel.correlation_unknown);
      sums->relative.push_back({channel.Degrees(), channel.scale_unknown, relative[c]});
      continue;
    }
    if (!channel.IsKnown()) {
      // Completed before they are copied and read, by several threads at once.
      channel.samples.Complete();
      channel.differences.Complete();
      sums->others.emplace_back(channel);
      continue;
    }
    sums->known.Add(channel.samples);
    if (channel.log_variance.size() > 0) {
      if (sums->log_variance.size() == 0) sums->log_variance.setZero(sums->known.terms());
      sums->log_variance += channel.log_variance;
      sums->log_variance_at_reference += channel.log_variance_at_reference;
    }
  }
  sums->known.Complete();
  sums_ = std::move(sums);
}

int Mismatch::terms() const { return sums_->known.terms(); }

double Mismatch::Evaluate(const ConstVectorRef& d) const {
  const Sums& sums = *sums_;
  double value = sums.has_known() ? sums.factored_known.ChiSquared(d) / 2 : 0;
  if (sums.log_variance.size() > 0) {
    value += sums.log_variance.dot(d) + sums.log_variance_at_reference;
  }
  for (const Sums::Channel& channel : sums.others) {
    const double differences =
        channel.sums.correlation_unknown ? channel.differences.ChiSquared(d) : 0;
    value +=
        polyest::internal::Evaluate(channel.sums, channel.samples.ChiSquared(d), differences).value;
  }
  for (const RobustSamples& samples : sums.kept) value += samples.Evaluate(d);
  for (const Sums::Relative& channel : sums.relative) {
    const RelativeSamples::Totals totals = channel.samples.At(d);
    value += channel.Of(totals.chi_squared).value + 0.5 * totals.log_variance;
  }
  return value;
}

double Mismatch::EvaluateWithGradient(const ConstVectorRef& d, VectorRef gradient) const {
  const Sums& sums = *sums_;
  // The gradient of a χ² is 2 (G d − b).
  double value = 0;
  if (sums.has_known()) {
    value = sums.factored_known.ChiSquaredWithGradient(d, gradient) / 2;
    gradient /= 2;
  } else {
    gradient.setZero();
  }
  if (sums.log_variance.size() > 0) {
    value += sums.log_variance.dot(d) + sums.log_variance_at_reference;
    gradient += sums.log_variance;
  }
  Vector by_samples(d.size()), by_differences(d.size());
  for (const Sums::Channel& channel : sums.others) {
    const bool correlation_unknown = channel.sums.correlation_unknown;
    const double a = channel.samples.ChiSquaredWithGradient(d, by_samples);
    double differences = 0;
    if (correlation_unknown) {
      differences = channel.differences.ChiSquaredWithGradient(d, by_differences);
    }
    const Likelihood l = polyest::internal::Evaluate(channel.sums, a, differences);
    value += l.value;
    gradient += l.by_a * by_samples;
    if (correlation_unknown) gradient += l.by_d * by_differences;
  }
  for (const RobustSamples& samples : sums.kept) {
    value += samples.EvaluateAddingGradient(d, gradient);
  }
  for (const Sums::Relative& channel : sums.relative) {
    const RelativeSamples::Totals totals =
        channel.samples.WithGradients(d, by_samples, by_differences);
    const Likelihood l = channel.Of(totals.chi_squared);
    value += l.value + 0.5 * totals.log_variance;
    gradient += l.by_a * by_samples + 0.5 * by_differences;
  }
  return value;
}

Matrix Mismatch::Curvature(const ConstVectorRef& d, const ConstMatrixRef& phi_gradient,
                           double spent) const {
  const Sums& sums = *sums_;
  const Eigen::Index n = phi_gradient.cols();
  Matrix curvature = Matrix::Zero(n, n);
  if (sums.has_known()) curvature = sums.factored_known.Information(phi_gradient);
  for (const RobustSamples& samples : sums.kept) curvature += samples.Curvature(d, phi_gradient);
  const double factor =
      std::max(0.1, 1 - spent / static_cast<double>(std::max<int64_t>(1, sums.count)));
  Vector gradient(d.size());
  for (const Sums::Relative& channel : sums.relative) {
    Vector unused(d.size());
    const double a = channel.samples.WithGradients(d, gradient, unused).chi_squared;
    const Vector by_a = phi_gradient.transpose() * gradient;
    const Likelihood l = channel.Of(a, factor);
    curvature +=
        channel.samples.Curvature(d, phi_gradient, l.by_a, 0.5) + l.by_aa * by_a * by_a.transpose();
  }
  for (const Sums::Channel& channel : sums.others) {
    const bool correlation_unknown = channel.sums.correlation_unknown;
    const double a = channel.samples.ChiSquaredWithGradient(d, gradient);
    const Vector by_a = phi_gradient.transpose() * gradient;
    double differences = 0;
    Vector by_d;
    if (correlation_unknown) {
      differences = channel.differences.ChiSquaredWithGradient(d, gradient);
      by_d = phi_gradient.transpose() * gradient;
    }
    const Likelihood l = polyest::internal::Evaluate(channel.sums, a, differences, factor);
    // Σ J_A ∂²A + J_AA ∂A ∂Aᵀ + …, with ∂²χ² = 2 G
    curvature +=
        2 * l.by_a * channel.samples.Information(phi_gradient) + l.by_aa * by_a * by_a.transpose();
    if (!correlation_unknown) continue;
    curvature += 2 * l.by_d * channel.differences.Information(phi_gradient) +
                 l.by_ad * (by_a * by_d.transpose() + by_d * by_a.transpose()) +
                 l.by_dd * by_d * by_d.transpose();
  }
  return curvature;
}

void Mismatch::EvaluateMany(const ConstMatrixRef& differences, Matrix& product,
                            VectorRef values) const {
  const Sums& sums = *sums_;
  values.setZero();
  if (sums.has_known()) {
    sums.factored_known.ChiSquaredMany(differences, product, values);
    values /= 2;
  }
  if (sums.log_variance.size() > 0) {
    values.noalias() += differences * sums.log_variance;
    values.array() += sums.log_variance_at_reference;
  }
  for (const RobustSamples& samples : sums.kept) samples.AddTo(values, differences, product);
  thread_local Vector a, d;  // kept from call to call, so that a sampler's sweeps do not allocate
  a.resize(values.size());
  d.resize(values.size());
  for (const Sums::Relative& channel : sums.relative) {
    channel.samples.EvaluateMany(differences, product, a, d);
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      values[i] += channel.Of(a[i]).value + 0.5 * d[i];
    }
  }
  for (const Sums::Channel& channel : sums.others) {
    const bool correlation_unknown = channel.sums.correlation_unknown;
    channel.samples.ChiSquaredMany(differences, product, a);
    if (correlation_unknown) channel.differences.ChiSquaredMany(differences, product, d);
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      values[i] +=
          polyest::internal::Evaluate(channel.sums, a[i], correlation_unknown ? d[i] : 0).value;
    }
  }
}

}  // namespace polyest::internal
