// How the filters of a block take a sample (filter_block.h).

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/propagation/filter_block.h"
#include "core/propagation/output_limit.h"

namespace polyest::internal {
namespace {

// How far along the line of the states the output is looked at, in standard deviations.
constexpr double kScanReach = 3;
// Departure from a straight line there that matters, in standard deviations of the noise: at one
// standard deviation of the states it is about a tenth of this for a parabola.
constexpr double kCurved = 0.01;
// Variance of what an output has beside its line, in that of the noise, up to which it is
// integrated along the line. Beyond, it is one of several combinations of the states, and the line
// says less of it than the filter's points do.
constexpr double kBesideLine = 0.1;
// Part of the way to the filters' points over which the gradient is taken.
constexpr double kGradientPart = 1e-3;
constexpr double kOutputRounding = 64 * std::numeric_limits<double>::epsilon();

}  // namespace

void FilterBlock::Update(const FilterSamples& samples, Eigen::Index sample, int channel,
                         MatrixRef innovations, MatrixRef log_variances) {
  const int members = member_count();
  const double sigma = samples.noise(channel, sample);
  auto innovation = innovations.col(sample * samples.values.rows() + channel);
  auto log_variance = log_variances.col(sample * samples.values.rows() + channel);
  innovation.segment(first_member_, members).setZero();
  log_variance.segment(first_member_, members).setZero();
  if (sigma > 0 && AnyAlive()) {
    ReadOutputs();
    SelectOutput(channel);
    noise_variance_.setConstant(sigma * sigma);
    if (noise_factors_.size() > 0) noise_variance_ *= noise_factors_.col(channel).square();
    if (backward_) factor_before_ = gaussians_.factor();
    const double z = samples.values(channel, sample);
    if (IsCurved(channel, z)) {
      UpdateCurved(channel, z, sigma);
    } else if (IsTailed(channel)) {
      UpdateTailed(z, sigma);
    } else {
      UpdateNormal(z, sigma);
    }
    innovation.segment(first_member_, members) = whitened_;
    log_variance.segment(first_member_, members) = log_variance_;
  }
  for (int i = 0; i < members; ++i) {
    if (alive_[static_cast<size_t>(i)]) continue;
    innovation[first_member_ + i] = std::numeric_limits<double>::quiet_NaN();
    log_variance[first_member_ + i] = std::numeric_limits<double>::quiet_NaN();
  }
}

// Sets the whitened innovations and log(S/σ²).
void FilterBlock::UpdateNormal(double z, double sigma) {
  gaussians_.Update(outputs_, z, noise_variance_, innovation_, variance_);
  if (backward_) {
    backward_->AddSample(outputs_, innovation_, variance_, variance_, factor_before_,
                         gaussians_.factor());
  }
  // Roots and logarithms of a vector may differ in the last bit from those of a number, so they
  // are taken in memory of one alignment.
  whitened_ = innovation_ / variance_.sqrt();
  log_variance_ = (variance_ / (sigma * sigma)).log();
}

// As UpdateNormal, with noise of Student's t distribution.
void FilterBlock::UpdateTailed(double z, double sigma) {
  variance_.setZero();
  gaussians_.Compare(outputs_, z, innovation_, variance_);
  for (Eigen::Index i = 0; i < innovation_.size(); ++i) {
    const HeavyTail::Result result =
        tail_.Take(innovation_[i], variance_[i], std::sqrt(noise_variance_[i]), sigma);
    whitened_[i] = result.innovation;
    log_variance_[i] = result.log_variance;
    gain_variance_[i] = result.gain_variance;
    noise_variance_[i] = result.noise_variance;
    spread_[i] = result.spread;
  }
  gaussians_.Correct(innovation_, gain_variance_, noise_variance_);
  if (backward_) {
    backward_->AddSample(outputs_, innovation_, gain_variance_, spread_, factor_before_,
                         gaussians_.factor());
  }
}

// Reads the channel's outputs at m + L u s for the first `count` columns of s.
void FilterBlock::ReadAlong(const Eigen::ArrayXXd& s, Eigen::Index count, int channel,
                            Eigen::ArrayXXd& values) {
  const Eigen::Index capacity = 2 * gaussians_.states();
  for (Eigen::Index first = 0; first < count; first += capacity) {
    const Eigen::Index columns = std::min(capacity, count - first);
    gaussians_.DrawAlong(s.middleCols(first, columns), points_);
    ReadDrawn(channel, values.middleCols(first, columns));
  }
}

// Reads the channel's outputs at the points drawn; NaN where they cannot be.
void FilterBlock::ReadDrawn(int channel, Eigen::Ref<Eigen::ArrayXXd> values) {
  const Eigen::Index members = member_count();
  const Eigen::ArrayXXd& outputs = block_.OutputsAt(points_);
  for (Eigen::Index k = 0; k < values.cols(); ++k) {
    auto column = values.col(k);
    column = outputs.col(channel).segment(k * members, members);
    if (specification_.output_gains.size() > 0) {
      column *= specification_.output_gains.col(channel).head(members).array();
    }
    if (specification_.output_offsets.size() > 0) {
      column += specification_.output_offsets.col(channel).head(members).array();
    }
    column = (column.abs() <= kMaxOutput).select(column, std::numeric_limits<double>::quiet_NaN());
  }
}

// Whether the output departs from a straight line where a member's states may be. Leaves the
// innovations in innovation_ and the variances of the outputs in variance_.
bool FilterBlock::IsCurved(int channel, double z) {
  variance_.setZero();
  gaussians_.Compare(outputs_, z, innovation_, variance_);
  if ((variance_ == 0).all()) return false;
  spread_ = gaussians_.FindDirection();
  scan_.col(0).setConstant(-kScanReach);
  scan_.col(1).setConstant(kScanReach);
  scan_.col(2).setConstant(-1);
  scan_.col(3).setConstant(1);
  ReadAlong(scan_, kScanned, channel, scanned_);
  bool curved = false;
  for (Eigen::Index i = 0; i < member_count(); ++i) {
    if (!alive_[static_cast<size_t>(i)]) continue;
    const double centre = (scanned_(i, 1) + scanned_(i, 0)) / 2;
    const double slope = (scanned_(i, 1) - scanned_(i, 0)) / (2 * kScanReach);
    const double departure = std::max(std::abs(scanned_(i, 2) - (centre - slope)),
                                      std::abs(scanned_(i, 3) - (centre + slope)));
    const double least = kCurved * std::sqrt(noise_variance_[i]) +
                         kOutputRounding * (std::abs(centre) + std::abs(slope));
    curved = curved || !(departure <= least);
  }
  return curved;
}

// Takes a sample of a curved output; results as UpdateNormal's.
void FilterBlock::UpdateCurved(int channel, double z, double sigma) {
  FindLine(channel);
  quadrature_.Begin(z, sigma, IsTailed(channel), noise_variance_, shift_, has_line_);
  do {
    ReadAlong(quadrature_.nodes(), OutputQuadrature::kNodes, channel, quadrature_.values());
  } while (quadrature_.Refine());
  for (Eigen::Index i = 0; i < member_count(); ++i) TakeIntegral(i, z, sigma, IsTailed(channel));
  gaussians_.Squeeze(mean_, squeezed_);
  if (backward_) AddCurvedSample();
}

// Turns u to the gradient, sets shift_ to μ, and adds V_d to noise_variance_: what the outputs at
// the filters' points have beside those of the points' projections onto the line. Where that is too
// much, has_line_ becomes false.
void FilterBlock::FindLine(int channel) {
  shift_.setZero();
  has_line_ = alive_;
  const Eigen::Index n = gaussians_.states(), members = member_count();
  if (n == 1) return;
  gaussians_.Draw(points_, kGradientPart);
  ReadDrawn(channel, scanned_.leftCols(2 * n));
  gaussians_.TurnToGradient(scanned_, kGradientPart);
  gaussians_.ProjectionsTo(scan_);
  ReadAlong(scan_, 2 * n, channel, scanned_);
  for (Eigen::Index k = 0; k < 2 * n; ++k) {
    scanned_.col(k) = outputs_.segment(k * members, members) - scanned_.col(k);
  }
  for (Eigen::Index i = 0; i < members; ++i) {
    const auto apart = scanned_.row(i).head(2 * n);
    const double mean = apart.mean(), variance = (apart - mean).square().mean();
    if (variance <= kBesideLine * noise_variance_[i]) {
      shift_[i] = mean;
      noise_variance_[i] += variance;
    } else {
      gaussians_.TurnBack(i);
      has_line_[static_cast<size_t>(i)] = false;
    }
  }
}

// Sets E, V, w and l of one member. Where there is no integral, these are the filter's own.
void FilterBlock::TakeIntegral(Eigen::Index member, double z, double sigma, bool tailed) {
  if (!alive_[static_cast<size_t>(member)]) {
    mean_[member] = whitened_[member] = log_variance_[member] = 0;
    squeezed_[member] = 1;
    return;
  }
  const bool found = quadrature_.Found(member);
  const double error = found ? z - quadrature_.OutputMean(member) : innovation_[member];
  const double spread = found ? quadrature_.OutputVariance(member) : variance_[member];
  const double R = noise_variance_[member], S = spread + R, slope = spread_[member];
  HeavyTail::Result result{error / std::sqrt(S), std::log(S / (sigma * sigma)), S, R, S};
  if (tailed) result = tail_.Take(error, spread, std::sqrt(R), sigma);
  whitened_[member] = result.innovation;
  if (found) {
    mean_[member] = quadrature_.Mean(member);
    squeezed_[member] = quadrature_.Variance(member);
    log_variance_[member] = quadrature_.Deviance(member) - result.innovation * result.innovation;
  } else {
    mean_[member] = slope * error / result.gain_variance;
    squeezed_[member] = std::max(0.0, 1 - slope * slope / result.spread);
    log_variance_[member] = result.log_variance;
  }
}

// Tells the smoother of a sample of a linear output with the slope u that would have told the same.
void FilterBlock::AddCurvedSample() {
  const Eigen::Index members = member_count();
  gaussians_.ProjectionsTo(scan_);
  for (Eigen::Index k = 0; k < 2 * gaussians_.states(); ++k) {
    outputs_.segment(k * members, members) = scan_.col(k);
  }
  gain_variance_.setOnes();
  spread_ = 1 / (1 - squeezed_);
  backward_->AddSample(outputs_, mean_, gain_variance_, spread_, factor_before_,
                       gaussians_.factor());
}

}  // namespace polyest::internal
