#include "core/estimator/expansion/regional_expansion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/bayes/noise.h"
#include "core/common/check.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/expansion/population_of_runs.h"

namespace polyest::internal {

absl::StatusOr<std::unique_ptr<RegionalExpansion>> RegionalExpansion::Make(
    const ResolvedProblem& problem, const SampleStore* store, ExpansionDesign design,
    LearnedNoise noise, int threads, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(CollocationMatrix matrix,
                           CollocationMatrix::Factor(*design.basis, design.points, stop));
  return std::unique_ptr<RegionalExpansion>(new RegionalExpansion(
      problem, store, std::move(design), std::move(noise), std::move(matrix), threads));
}

RegionalExpansion::RegionalExpansion(const ResolvedProblem& problem, const SampleStore* store,
                                     ExpansionDesign design, LearnedNoise noise,
                                     CollocationMatrix matrix, int threads)
    : problem_(problem),
      design_(std::move(design)),
      noise_(std::move(noise)),
      threads_(threads),
      channels_(problem.channels()),
      reference_phi_(design_.basis->size()),
      trajectories_(problem_, store, design_, noise_.channels, std::move(matrix), threads),
      absorbed_({.terms = design_.basis->size(),
                 .channels = channels_,
                 .points = trajectories_.points(),
                 .check_points = trajectories_.checks(),
                 .controls = trajectories_.controls()}),
      difference_(design_.basis->size()) {
  POLYEST_CHECK(static_cast<int>(noise_.channels.size()) == channels_);
  design_.basis->Evaluate(design_.reference, reference_phi_);
  if (design_.in_tails) prior_moments_ = MomentsUnderPrior(problem_.prior(), design_);
  BeginSums();
  LookFromPosterior();
  Linearize();
  TakeEndedRuns();
  KeepFewSamples();
}

// Sets how the sums of each channel become a likelihood.
void RegionalExpansion::BeginSums() {
  for (int c = 0; c < channels_; ++c) {
    const NoiseModel& model = ModelOf(c);
    ChannelSums& sums = absorbed_.sums[static_cast<size_t>(c)];
    const bool learned = noise_.channels[static_cast<size_t>(c)].learned;
    sums.scale_unknown = model.unknown && learned;
    // Filters give their samples the density themselves.
    if (!problem_.uses_filters()) {
      absorbed_.densities[static_cast<size_t>(c)] = OutlierDensity(model.outliers, model.unknown);
    }
    // A time constant found by its likelihood is taken as known: the one lag that is integrated out
    // is not that of irregular samples.
    const bool found = noise_.channels[static_cast<size_t>(c)].time_constant_s > 0 &&
                       model.outliers == OutlierHandling::kNone;
    sums.correlation_unknown = model.correlation == NoiseCorrelation::kUnknown && learned && !found;
    sums.degrees_factor = !problem_.uses_filters() ? BoundedDegreesFactor(model.outliers)
                          : IsTailed(c)            ? kFilteredDegreesFactor
                                                   : 1;
  }
  if (!problem_.uses_filters()) return;
  for (ChannelSums& sums : absorbed_.sums) sums.log_variance.setZero(reference_phi_.size());
  absorbed_.point_log_variance.setZero(design_.points.rows());
}

void RegionalExpansion::LookFromPosterior() {
  const int terms = design_.basis->size();
  if (noise_.posterior.centre.size() == 0) {
    // The posterior is not known yet, so outliers are judged by the spread of the expansion itself,
    // Σ c_s² over s ≥ 1 (12).
    centre_phi_ = reference_phi_;
    spread_ = Matrix::Identity(terms, terms).rightCols(terms - 1);
    return;
  }
  const Vector eta = design_.region.ToLocal(noise_.posterior.centre);
  centre_phi_.resize(terms);
  Matrix phi_gradient(terms, eta.size());
  design_.basis->EvaluateWithGradient(eta, centre_phi_, phi_gradient);
  spread_ = phi_gradient * Inverse(design_.region.axes()) * noise_.posterior.factor;
}

absl::Status RegionalExpansion::Propagate(const RowBlock& block, const Stop& stop) {
  KeepState(block.rows.front().run);
  POLYEST_RETURN_IF_ERROR(trajectories_.Propagate(block, block_, stop));
  PredictNoise();
  return absl::OkStatus();
}

double RegionalExpansion::ResidualToNoise(int row) const {
  double worst = 0;
  for (int c = 0; c < channels_; ++c) {
    const double noise = block_.Noise(row, c);
    if (noise > 0) {
      worst = std::max(worst, std::sqrt(block_.residual_variance[block_.Column(row, c)]) / noise);
    }
  }
  return worst;
}

Vector RegionalExpansion::TermWeights() const {
  Vector weights = Vector::Zero(design_.basis->size());
  for (const ChannelSums& sums : absorbed_.sums) weights += sums.samples.G().diagonal();
  return weights;
}

// With polynomials that are orthonormal under the prior, an output cᵀφ has the mean c_0 and the
// variance Σ c_s² over s ≥ 1 (12). Over the tails they are not, and it has those of φ.
std::optional<PriorPrediction> RegionalExpansion::PredictionOf(int row, int channel) const {
  const double sigma = block_.Noise(row, channel);
  if (!(design_.whole_prior || design_.in_tails) || sigma <= 0) return std::nullopt;
  const int column = block_.Column(row, channel);
  const auto coefficients = block_.coefficients.col(column);
  PriorPrediction prediction;
  prediction.value = block_.Value(row, channel);
  if (design_.in_tails) {
    prediction.mean = coefficients.dot(prior_moments_.mean);
    prediction.variance = coefficients.dot(prior_moments_.covariance * coefficients);
  } else {
    prediction.mean = coefficients[0];
    prediction.variance = coefficients.tail(coefficients.size() - 1).squaredNorm();
  }
  prediction.variance += block_.residual_variance[column];
  prediction.noise = sigma;
  if (!std::isfinite(prediction.variance) || !std::isfinite(prediction.mean)) return std::nullopt;
  return prediction;
}

double RegionalExpansion::Magnitude(int row, int channel) const {
  return row < block_.fitted_rows ? block_.coefficients.col(block_.Column(row, channel)).norm() : 0;
}

void RegionalExpansion::Absorb(int row) {
  const auto [run, time_s] = block_.Row(row);
  if (run != absorbed_.summed_run) {
    EndRunOfSums();
    absorbed_.summed_run = run;
    absorbed_.carried_rate = 0;
  }
  for (int c = 0; c < channels_; ++c) {
    if (block_.Noise(row, c) > 0) AbsorbSample(Weighted(row, c));
  }
  if (problem_.ended_runs() == nullptr) {
    absorbed_.windows.EndRow(absorbed_.sums, run, time_s);
  }
  ++absorbed_.rows;
  absorbed_.propagated += trajectories_.count();
}

WeightedSample RegionalExpansion::Weighted(int row, int channel) const {
  WeightedSample sample{.row = row, .channel = channel, .column = block_.Column(row, channel)};
  sample.model = &ModelOf(channel);
  sample.value = block_.Value(row, channel);
  sample.sigma = block_.Noise(row, channel);
  sample.own_error = block_.residual_variance[sample.column] / noise_.misfit_of_weights;
  sample.deviation = DeviationFromCentre(sample);
  // Filters handle outliers themselves.
  if (!problem_.uses_filters()) sample.outliers = sample.model->outliers;
  const double weight = OutlierWeight(sample.outliers, sample.deviation);
  sample.noise = VarianceFactor(sample.outliers) * sample.sigma * sample.sigma / weight;
  sample.lack = problem_.uses_filters() && IsTailed(channel)
                    ? LackOfDensity(sample.model->outliers)
                    : LackOfWeight(sample.outliers, sample.deviation);
  if (!IsScored(channel)) return sample;
  const ScoredSample scored = Scored(sample);
  sample.value = scored.value;
  sample.noise = scored.noise_variance;
  sample.lack += scored.lack;
  return sample;
}

void RegionalExpansion::AbsorbSample(const WeightedSample& sample) {
  const auto coefficients = CoefficientsOf(sample);
  const double variance = sample.variance();
  // e = z − cᵀφ_0
  const double error = sample.value - coefficients.dot(reference_phi_);
  absorbed_.sums[static_cast<size_t>(sample.channel)].samples.Add(coefficients, error, variance);
  AddDifference(sample, error);
  AddToProfile(sample);
  AddToBlocks(sample);
  AddOwnError(sample);
  Normalize(sample);
  CountOutlier(sample);
  AddToDensity(sample);
  Compare(sample);
  CompareControls(sample);
  if (absorbed_.few) AddToFew(sample);
  if (problem_.uses_filters()) AddLogVariance(sample);
  // χ²_q += (z − y_q)²/R
  const auto outputs = block_.outputs.col(sample.column).head(points()).array();
  absorbed_.point_chi_squared.col(sample.channel).array() +=
      (outputs - sample.value).square() / variance;
  ++absorbed_.sample_count;
}

// Adds what of the variance is the expansion's own error.
void RegionalExpansion::AddOwnError(const WeightedSample& sample) {
  const double variance = sample.variance();
  absorbed_.discount[sample.channel] += sample.own_error / variance;
  absorbed_.own_error +=
      block_.residual_variance[sample.column] / variance + absorbed_.carried_rate;
  absorbed_.carried_error += absorbed_.carried_rate;
}

void RegionalExpansion::Normalize(const WeightedSample& sample) {
  const double noise = VarianceFactor(sample.outliers) * sample.sigma * sample.sigma;
  absorbed_.log_noise += 0.5 * std::log(noise) + sample.lack;
  absorbed_.log_variance += 0.5 * std::log(noise + sample.own_error) + sample.lack;
}

// Ends the run summed so far. The differences get its last u, as they got its first: every u² of an
// ended run is then in them twice, but for the products of successive ones.
void RegionalExpansion::EndRunOfSums() {
  for (int c = 0; c < channels_ && absorbed_.summed_run >= 0; ++c) {
    absorbed_.sums[static_cast<size_t>(c)].differences.Add(absorbed_.previous_coefficients.col(c),
                                                           absorbed_.previous_error[c], 1);
  }
  absorbed_.previous_coefficients.setZero();
  absorbed_.previous_error.setZero();
  for (CorrelationProfile& profile : absorbed_.profiles) profile.BeginRun();
  for (ResidualBlocks& blocks : absorbed_.blocks) blocks.BeginRun();
}

// Adds u_k − u_{k−1} with u = e/√R, for the residuals' lag-1 correlation.
void RegionalExpansion::AddDifference(const WeightedSample& sample, double error) {
  const double unit = 1 / std::sqrt(sample.variance());
  auto previous = absorbed_.previous_coefficients.col(sample.channel);
  difference_ = unit * CoefficientsOf(sample) - previous;
  double& previous_error = absorbed_.previous_error[sample.channel];
  absorbed_.sums[static_cast<size_t>(sample.channel)].differences.Add(
      difference_, unit * error - previous_error, 1);
  previous = unit * CoefficientsOf(sample);
  previous_error = unit * error;
}

double RegionalExpansion::RoundingError() const {
  double squares = 0;
  for (const ChannelSums& sums : absorbed_.sums) squares += sums.samples.w();
  return std::numeric_limits<double>::epsilon() * squares;
}

Cost RegionalExpansion::MakeCost(double regularization) const {
  const std::optional<SampleBySample>& few = absorbed_.few;
  Cost cost(design_.basis, design_.region, design_.reference,
            few ? Mismatch(absorbed_.sums, few->channels, few->relative) : Mismatch(absorbed_.sums),
            problem_.prior(), regularization, WithinKnown(problem_, design_.element));
  cost.set_power(1 / noise_.misfit);
  cost.set_threads(threads_);
  if (remainder_.size() > 0) cost.set_remainder(remainder_);
  // Without a prior there is no population either.
  if (regularization > 0 && problem_.population()) {
    cost.set_population(PopulationCostOf(problem_));
  }
  return cost;
}

}  // namespace polyest::internal
