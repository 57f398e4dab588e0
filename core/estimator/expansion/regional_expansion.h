#pragma once

// An expansion that advances along the record. It holds the trajectories and their fit
// (fitted_trajectories.h), and the mismatch sums that result. Memory does not grow with the number
// of samples.
//
// The expansion's own error is treated as noise: a sample enters the sums with R = σ² + ρ, ρ being
// the residual variance of the fit at its time. A region that is still too wide thus gives a
// posterior that is wide but not wrong. Where the cost is divided by a misfit (learned_noise.h), so
// is ρ, because it is then small beside the residuals. The noise is the noise learned so far
// (learned_noise.h). Correlated samples are whitened first. Outliers lose weight according to their
// residual at the posterior's centre, compared with the noise and the posterior's own spread there.
// While they are few, the samples of channels with outliers and known noise are kept besides, and
// those of channels whose noise is relative to the prediction, and their likelihood is that of each
// sample (bayes/robust_samples.h, bayes/relative_samples.h).
//
// Where the likelihood is that of prediction errors (polyest/problem.h), the variances add
// ½ Σ log(S_k/σ_k²), discounted as their samples are by σ²/R. Outliers are handled by the filters
// (propagation/heavy_tail.h), whose w and log S/σ² are those of Student's t.

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <vector>

#include "core/bayes/mismatch.h"
#include "core/bayes/relative_noise.h"
#include "core/estimator/expansion/absorbed_rows.h"
#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/expansion/fitted_block.h"
#include "core/estimator/expansion/fitted_trajectories.h"
#include "core/estimator/expansion/weighted_sample.h"
#include "core/estimator/record/data_facts.h"
#include "core/estimator/record/learned_noise.h"
#include "polyest/samples.h"

namespace polyest::internal {

struct ExpansionState;

class RegionalExpansion {
 public:
  // Makes an expansion that has absorbed no rows. Returns InfeasibleError when the design's
  // collocation matrix cannot be factored, or the status of a stop request. `problem` and `store`,
  // which has the rows, must outlive the expansion; the store may be null if no input is streamed.
  static absl::StatusOr<std::unique_ptr<RegionalExpansion>> Make(const ResolvedProblem& problem,
                                                                 const SampleStore* store,
                                                                 ExpansionDesign design,
                                                                 LearnedNoise noise, int threads,
                                                                 const Stop& stop = {});

  // Restores an expansion from a state that State returned. The store must hold at least its rows.
  // Returns DataLoss when the state cannot belong to such a problem, FailedPrecondition when the
  // rows differ from those of the state, the status of a stop request.
  static absl::StatusOr<std::unique_ptr<RegionalExpansion>> FromState(
      const ResolvedProblem& problem, ExpansionState state, const SampleStore& store, int threads,
      const Stop& stop);
  // Returns the state. All propagated rows must have been absorbed. The last one must be at a
  // checkpoint, or anywhere if a new run begins next.
  ExpansionState State() const;

  // Propagates over a block of rows of the store that follows the rows propagated before, and fits
  // the outputs of the first fitted_rows() rows. These are all rows, unless too few trajectories
  // are left at the next one; shortage() then explains why. Only a stop request or an error of the
  // store returns an error; the expansion is then unusable.
  absl::Status Propagate(const RowBlock& block, const Stop& stop);
  int fitted_rows() const { return block_.fitted_rows; }
  const absl::Status& shortage() const { return trajectories_.shortage(); }
  // Returns, for row `row` of the block propagated last, the expansion's residual in units of the
  // noise: the largest over the channels with a sample.
  double ResidualToNoise(int row) const;
  // Returns how much each term of the basis contributes (S), Σ c_s²/R over the absorbed samples.
  Vector TermWeights() const;
  // Returns what the prior predicts for the channel's sample in that row, if the expansion is over
  // the whole prior or over its tails, too, and the prediction is finite. Samples with correlated
  // noise are whitened.
  std::optional<PriorPrediction> PredictionOf(int row, int channel) const;
  // Returns the root mean square over the germ of a channel's output at row `row` of the block
  // propagated last; 0 where too few trajectories are left.
  double Magnitude(int row, int channel) const;
  // Adds the row to the sums. Rows are absorbed in order, each once.
  void Absorb(int row);
  // Sets the row of the store that is the first to be propagated; no row has been yet.
  void BeginAt(int64_t row) { trajectories_.BeginAt(row); }
  int64_t next_row() const { return trajectories_.next_row(); }  // to be propagated
  // Returns how many rows of a block that follows the rows propagated, at least one, to propagate
  // with the next call so that it ends where a state can be kept.
  int RowsToKeptState(const RowBlock& block) const;
  // Returns the state after the last checkpoint in the run, or before a run if many rows have
  // passed since the last one; null without any. What it says of noise may have been revised since.
  const std::shared_ptr<const ExpansionState>& kept_state() const { return kept_state_; }
  // Ends the run absorbed so far. No more rows are absorbed then.
  void EndRun() { EndRunOfSums(); }
  // Adds what counts along with the sums to that of the ended runs.
  void AddCountsTo(EndedRuns& ended) const;

  const ExpansionDesign& design() const { return design_; }
  // The new element must contain the present one; the region stays as it is.
  void set_element(Element element) { design_.element = std::move(element); }
  const LearnedNoise& noise() const { return noise_; }
  void set_misfit(double misfit) { noise_.misfit = misfit; }
  // Whether its trajectories are stepped without error of integration (linear_system.h).
  bool StepsExactly() const { return trajectories_.StepsExactly(); }
  int points() const { return trajectories_.points(); }
  int64_t absorbed_rows() const { return absorbed_.rows; }
  int64_t propagated_rows() const { return absorbed_.propagated; }  // trajectories × rows
  const std::vector<FailedTrajectory>& failures() const { return trajectories_.failures(); }
  // Returns the indices of the collocation points that are still in the fit, ascending.
  const std::vector<int>& kept_points() const { return trajectories_.kept(); }

  // Returns the sums of each measured channel, over all runs.
  const std::vector<ChannelSums>& sums() const { return absorbed_.sums; }
  const WindowSums& windows() const { return absorbed_.windows; }
  // Returns all that the rows absorbed have contributed.
  const AbsorbedRows& absorbed() const { return absorbed_; }
  // Returns the number of a channel's samples lost to the expansion's own error.
  double Discount(int channel) const { return absorbed_.discount[channel]; }
  // Returns the part of absorbed().OwnError() that the check points' own trajectories do not show,
  // because it was taken over from an expansion over another region.
  double CarriedError() const { return absorbed_.carried_error; }
  // Returns the rounding error of the sums' χ², ε Σ e²/R with the errors e at the reference: of a
  // posterior far from it, little is left of their squares (bayes/mismatch_sums.h).
  double RoundingError() const;
  // Returns the root mean square, over the collocation points, of ½ Σ log(S/σ²) of the model minus
  // that of the expansion; 0 without filters.
  double LogVarianceError() const;
  // Returns the expansions of the filters' states after the rows propagated; nothing without
  // filters or before the first row.
  std::optional<FilteredStates> Filtered() const { return trajectories_.Filtered(); }
  // Returns the sums of blocks of a channel's residuals, linearized at LinearizedAt(); without any
  // block where filters predict.
  const ResidualBlocks& Blocks(int channel) const {
    return absorbed_.blocks[static_cast<size_t>(channel)];
  }
  // Returns the likelihood of a channel's residuals for other time constants, about LinearizedAt().
  const CorrelationProfile& Profile(int channel) const {
    return absorbed_.profiles[static_cast<size_t>(channel)];
  }
  const Vector& LinearizedAt() const { return linearized_at_; }  // η, n
  // Returns the number of samples of a channel that have less than half their weight.
  int64_t Outliers(int channel) const { return absorbed_.outliers[static_cast<size_t>(channel)]; }
  // Returns the density of the samples of a channel with outliers that its sums weigh; null without
  // any, or while they are kept.
  const OutlierDensity* DensityOfWeighted(int channel) const;
  // Returns the point at which outliers are judged, η.
  Vector CentreOfWeights() const;
  // Returns the cost on this expansion with α² = regularization and the likelihood to the power
  // 1/misfit.
  Cost MakeCost(double regularization) const;

  // Agreement with the model itself at the check points: each one's χ² per channel from its own
  // trajectory, and the root mean square of (model − expansion)/σ over the samples.
  struct Check {
    Matrix chi_squared;  // check points × m
    Vector residual_to_noise;
    std::vector<bool> valid;  // whether the trajectory could be integrated
    int64_t samples = 0;
  };
  Check Checks() const;

  // Returns the number K of control trajectories, the i-th for the i-th check point.
  int controls() const { return trajectories_.controls(); }
  // Whether the i-th control trajectory and its check point's could be integrated.
  bool IsControlValid(int i) const { return absorbed_.control_valid[static_cast<size_t>(i)]; }
  // Returns Σ c_k δ_k/R_k (S) of a channel, δ_k the i-th control's output minus its check point's.
  Vector ControlScore(int i, int channel) const {
    return absorbed_.control_scores.col(i * channels_ + channel);
  }

 private:
  RegionalExpansion(const ResolvedProblem& problem, const SampleStore* store,
                    ExpansionDesign design, LearnedNoise noise, CollocationMatrix matrix,
                    int threads);

  // The states kept between rows (kept_state.cc, expansion_state.cc).
  void KeepState(int next_run);
  absl::Status RestoreSums(AbsorbedRows state);

  // Noise and outliers as the posterior's centre tells them (noise_at_centre.cc, outliers.cc).
  void LookFromPosterior();
  void Linearize();
  void PredictNoise();
  bool IsScored(int channel) const;
  bool IsTailed(int channel) const { return ModelOf(channel).outliers != OutlierHandling::kNone; }
  ScoredSample Scored(const WeightedSample& sample) const;
  double DeviationFromCentre(const WeightedSample& sample) const;
  void CountOutlier(const WeightedSample& sample);
  void AddToDensity(const WeightedSample& sample);

  // Samples that are kept (few_samples.cc).
  void KeepFewSamples();
  bool IsKeptRelative(int channel) const;
  void AddToFew(const WeightedSample& sample);
  void AddRelative(const WeightedSample& sample);
  void AddRobust(WeightedSample sample);

  // The sums of the samples, begun with those of ended runs (ended_runs_sums.cc).
  void BeginSums();
  void TakeEndedRuns();
  void EndRunOfSums();
  WeightedSample Weighted(int row, int channel) const;
  // Adds a sample to all of the sums; each function below adds it to one of them.
  void AbsorbSample(const WeightedSample& sample);
  void AddDifference(const WeightedSample& sample, double error);
  void AddToBlocks(const WeightedSample& sample);
  void AddToProfile(const WeightedSample& sample);
  void AddLogVariance(const WeightedSample& sample);
  void AddOwnError(const WeightedSample& sample);
  void Normalize(const WeightedSample& sample);

  // What check points and controls tell of the expansion's error (control_trajectories.cc).
  void Compare(const WeightedSample& sample);
  void CompareControls(const WeightedSample& sample);

  const NoiseModel& ModelOf(int channel) const {
    return problem_.problem().measured[static_cast<size_t>(channel)].noise;
  }
  auto CoefficientsOf(const WeightedSample& sample) const {
    return block_.coefficients.col(sample.column);
  }

  const ResolvedProblem& problem_;
  ExpansionDesign design_;
  PriorMoments prior_moments_;  // empty unless the design is in the prior's tails
  LearnedNoise noise_;
  int threads_;
  int channels_;
  Vector reference_phi_;
  FittedTrajectories trajectories_;
  FittedBlock block_;  // propagated last
  std::shared_ptr<const ExpansionState> kept_state_;

  // Outliers are judged at φ(η̂), where η̂ is the posterior's centre, relative to the posterior's
  // own spread: an output cᵀφ has the variance ‖spread_ᵀ c‖² there.
  Vector centre_phi_;
  Matrix spread_;  // S × n

  // Where noise is predicted and about which residuals are linearized: η, φ and ∂φ/∂η.
  Vector linearized_at_;
  Vector linearized_phi_;
  Matrix linearized_gradient_;  // S × n

  AbsorbedRows absorbed_;
  Vector remainder_;   // coefficients of what ended runs add to the cost (S); empty without any
  Vector difference_;  // S
  Vector slope_;       // n
};

}  // namespace polyest::internal
