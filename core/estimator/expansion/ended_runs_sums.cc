// What an expansion takes over from the runs that have ended, and what it hands on
// (problem/ended_runs.h).

#include <cmath>

#include "core/bayes/noise.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {
namespace {

// Returns the values of the ended runs' terms at points (Q × n, local coordinates of the region) of
// an expansion, Q × S_ended.
Matrix TermsAt(const EndedRuns& ended, const Region& region, const std::vector<int>& shared,
               const Matrix& etas) {
  const Matrix xis = region.ManyToGerm(etas);
  Matrix terms;
  ended.basis->EvaluateMany(ended.region.ManyToLocal(xis(Eigen::all, shared)), terms);
  return terms;
}

// Adds what counts along with the sums; `ratio` is that of the noise's variances, now to then.
void AddCounts(const EndedRuns& ended, const Vector& ratio, AbsorbedRows& absorbed) {
  absorbed.rows = ended.rows;
  absorbed.sample_count = ended.sample_count;
  absorbed.discount = ended.discount;
  absorbed.own_error = ended.own_error;
  absorbed.log_noise = ended.log_noise;
  absorbed.log_variance = ended.log_variance;
  absorbed.outliers = ended.outliers;
  absorbed.largest = ended.largest;
  for (size_t c = 0; c < ended.sums.size(); ++c) {
    const auto count = static_cast<double>(ended.sums[c].samples.count());
    const double change = 0.5 * count * std::log(ratio[static_cast<Eigen::Index>(c)]);
    absorbed.log_noise += change;
    absorbed.log_variance += change;
  }
}

// Returns ChannelSums::surplus for a noise whose variance is `ratio` times that of then.
double SurplusAt(const EndedRuns& ended, const NoiseModel& noise, size_t channel, double ratio) {
  const double counted =
      OutlierDegrees(noise.outliers) * static_cast<double>(ended.outliers[channel]);
  return (ended.sums[channel].surplus + counted) / ratio - counted;
}

}  // namespace

// The terms of the ended runs are polynomials of the shared germs, so that the expansion's own
// terms represent them: φ_ended = Mᵀφ, exactly unless its order is less. Where the model is
// compared with the expansion, the ended runs count as followed exactly.
void RegionalExpansion::TakeEndedRuns() {
  const EndedRuns* ended = problem_.ended_runs();
  if (ended == nullptr) return;
  const std::vector<int> shared = problem_.SharedParameters();
  const Matrix terms = TermsAt(*ended, design_.region, shared, design_.points);
  Matrix transfer(design_.basis->size(), terms.cols());
  Vector residual(terms.cols());
  CollocationMatrix matrix = trajectories_.matrix();
  matrix.Solve(terms, transfer, residual);
  // d_ended = φ_ended − φ_ended(0) = Mᵀd + δ
  const Vector shift = transfer.transpose() * reference_phi_ - TermsAtCentre(*ended);
  Vector ratio(channels_);
  Matrix point_phi, check_phi;
  design_.basis->EvaluateMany(design_.points, point_phi);
  design_.basis->EvaluateMany(design_.check_points, check_phi);
  for (int c = 0; c < channels_; ++c) {
    const auto channel = static_cast<size_t>(c);
    const double scale = noise_.channels[channel].scale / ended->noise_scale[c];
    ratio[c] = scale * scale;
    ChannelSums& sums = absorbed_.sums[channel];
    const ChannelSums& before = ended->sums[channel];
    sums.samples = before.samples.Substituted(transfer, shift, ratio[c]);
    sums.differences = before.differences.Substituted(transfer, shift, ratio[c]);
    sums.surplus = SurplusAt(*ended, problem_.problem().measured[channel].noise, channel, ratio[c]);
    sums.spent = before.spent;
    for (Eigen::Index i = 0; i < check_phi.rows(); ++i) {
      absorbed_.check_chi_squared(i, c) =
          sums.samples.ChiSquared(check_phi.row(i).transpose() - reference_phi_);
    }
    for (Eigen::Index q = 0; q < point_phi.rows(); ++q) {
      absorbed_.point_chi_squared(q, c) =
          sums.samples.ChiSquared(point_phi.row(q).transpose() - reference_phi_);
    }
  }
  AddCounts(*ended, ratio, absorbed_);
  remainder_ = transfer * ended->remainder;
}

void RegionalExpansion::AddCountsTo(EndedRuns& ended) const {
  ended.sample_count += absorbed_.sample_count;
  ended.discount += absorbed_.discount;
  ended.own_error += absorbed_.own_error;
  ended.log_noise += absorbed_.log_noise;
  ended.log_variance += absorbed_.log_variance;
  ended.largest = ended.largest.cwiseMax(absorbed_.largest);
  for (size_t c = 0; c < ended.outliers.size(); ++c) ended.outliers[c] += absorbed_.outliers[c];
}

}  // namespace polyest::internal
