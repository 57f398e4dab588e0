#pragma once

// An expansion on its way along the record: the ensemble of trajectories, the coefficients
// c_k = A⁺ Y_k (10) of every measured output at every sample time, and the mismatch sums they
// leave behind. Memory does not grow with the number of samples.
//
// The expansion's own error is treated as noise: a sample enters the sums with R = σ² + the
// residual variance of the fit at its time, so that a region still too wide gives a posterior that
// is wide and not wrong. The noise is what has been learned of it so far (learned_noise.h):
// correlated samples are whitened first, outliers lose weight by their residual at the posterior's
// centre, beside what the posterior leaves open there.

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

#include "core/bayes/mismatch.h"
#include "core/chaos/collocation_matrix.h"
#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/record/learned_noise.h"
#include "core/estimator/record/whitening.h"
#include "polyest/samples.h"

namespace polyest::internal {

// A trajectory left out, with the parameters that made it fail.
struct FailedTrajectory {
  Vector theta;
  int run = 0;
  double time_s = 0;
  int flag = 0;
  std::string reason;
};

// What the rows absorbed by an expansion have left behind.
struct AbsorbedRows {
  // With S terms, m channels and C check points.
  AbsorbedRows(int terms, int channels, Eigen::Index check_points);

  int64_t rows = 0;
  int64_t samples = 0;            // over all channels
  int64_t propagated = 0;         // trajectories × rows
  std::vector<ChannelSums> sums;  // by channel, over all runs
  Vector discount;                // by channel: Σ ρ_k/R_k
  double log_noise = 0;           // Σ ½ log σ² + what outliers' weights lack
  double log_variance = 0;        // the same with R in place of σ²
  std::vector<int64_t> outliers;  // by channel
  // By channel, the sample before in units of its noise; a zero where a run begins.
  int summed_run = -1;
  Matrix previous_coefficients;  // S × m
  Vector previous_error;
  // At the check points.
  Matrix check_chi_squared;       // C × m
  Vector check_residual;          // Σ ((model − expansion)/σ)²
  std::vector<bool> check_valid;  // the trajectory could be integrated
};

struct ExpansionState;

class RegionalExpansion {
 public:
  // FAILED_PRECONDITION when the design's collocation matrix cannot be factored. `problem` must
  // outlive the expansion.
  static absl::StatusOr<std::unique_ptr<RegionalExpansion>> Make(const ResolvedProblem& problem,
                                                                 ExpansionDesign design,
                                                                 LearnedNoise noise, int threads);

  // One in that state (State), on a store that has its rows at least. DATA_LOSS when the state
  // cannot be of such a problem, FAILED_PRECONDITION when it is not of those rows.
  static absl::StatusOr<std::unique_ptr<RegionalExpansion>> FromState(
      const ResolvedProblem& problem, ExpansionState state, const SampleStore& store, int threads);
  // After all rows propagated have been absorbed, at a checkpoint or, for a new run to begin on,
  // anywhere.
  ExpansionState State() const;

  // Propagates over a block of rows that follows the rows propagated before, and fits the outputs
  // of the first fitted_rows(): all, unless too few trajectories are left at the one after, which
  // shortage() then explains. Only a stop request makes it not OK; the expansion is then of no
  // further use.
  absl::Status Propagate(const RowBlock& block, const Stop& stop);
  int fitted_rows() const { return fitted_rows_; }
  const absl::Status& shortage() const { return shortage_; }
  // Of row `row` of the block propagated last: the largest, over the channels with a sample, of
  // the expansion's residual in units of the noise.
  double ResidualToNoise(int row) const;
  // Takes the row into the sums. Rows are absorbed in order, each once.
  void Absorb(int row);

  const ExpansionDesign& design() const { return design_; }
  const LearnedNoise& noise() const { return noise_; }
  int points() const { return static_cast<int>(design_.points.rows()); }
  int64_t absorbed_rows() const { return absorbed_.rows; }
  // Trajectories × rows.
  int64_t propagated_rows() const { return absorbed_.propagated; }
  const std::vector<FailedTrajectory>& failures() const { return failures_; }

  // One a measured channel, over all runs.
  const std::vector<ChannelSums>& sums() const { return absorbed_.sums; }
  // Of a channel: Σ ρ_k/R_k, how many of its samples the expansion's own error ρ has cost.
  double Discount(int channel) const { return absorbed_.discount[channel]; }
  // Samples of a channel with less than half their weight.
  int64_t Outliers(int channel) const { return absorbed_.outliers[static_cast<size_t>(channel)]; }
  // What makes the costs of different expansions of the same record comparable, each with its own
  // noise and weights of outliers: Σ ½ log R_k, and what reweighting leaves out of the likelihood.
  // R with the expansion's own error, which belongs to the sums, or without.
  double LogNormalization(bool with_own_error) const {
    return with_own_error ? absorbed_.log_variance : absorbed_.log_noise;
  }
  // The cost on this expansion with α² = regularization.
  Cost MakeCost(double regularization) const;

  // Agreement with the model itself, at the check points: each one's χ² by channel from its own
  // trajectory, and root mean square of (model − expansion)/σ over the samples.
  struct Check {
    Matrix chi_squared;  // check points × m
    Vector residual_to_noise;
    std::vector<bool> valid;  // the trajectory could be integrated
    int64_t samples = 0;
  };
  Check Checks() const;

 private:
  RegionalExpansion(const ResolvedProblem& problem, ExpansionDesign design, LearnedNoise noise,
                    CollocationMatrix matrix, int threads);

  void StartRun(int run);
  absl::Status PropagateRun(int first, int count, const Stop& stop);
  absl::Status RestoreFit(ExpansionState& state);
  absl::Status RestoreRun(const ExpansionState& state, const SampleStore& store);
  void AppendKnots(int row);
  void FitRows(int first, int count);
  bool FailsAt(int row) const;
  absl::Status DropFailed(int row);
  void NoteFailures(int row);
  void LookFromPosterior();
  double DeviationFromCentre(int channel, const ConstVectorRef& coefficients, double z,
                             double variance) const;
  void AddDifference(int channel, const ConstVectorRef& coefficients, double error,
                     double variance);
  void Normalize(double noise, double own_error, double lack);
  void Compare(int column, double z, double variance);

  const ResolvedProblem& problem_;
  ExpansionDesign design_;
  LearnedNoise noise_;
  CollocationMatrix matrix_;
  int threads_;
  int channels_;
  Vector reference_phi_;
  Matrix check_phi_;  // C × S

  Matrix thetas_;          // (Q + C) × n
  std::vector<int> kept_;  // the collocation points still in the fit
  int run_ = -1;
  std::unique_ptr<InputSignals> inputs_;
  double knot_time_s_ = 0;        // of the last knot of the streamed inputs
  bool inputs_finished_ = false;  // no more knots in this run
  std::unique_ptr<EnsemblePropagator> propagator_;
  std::vector<FailedTrajectory> failures_;

  // Of the block propagated last.
  RowBlock block_;
  Matrix outputs_;            // (Q + C) × (m · rows)
  Matrix coefficients_;       // S × (m · rows)
  Vector residual_variance_;  // m · rows
  int fitted_rows_ = 0;
  absl::Status shortage_;

  Whitening whitening_;
  // Outliers are looked for at φ(η̂), η̂ the posterior's centre, beside the posterior's own spread:
  // of an output cᵀφ its variance there is ‖spread_ᵀ c‖².
  Vector centre_phi_;
  Matrix spread_;  // S × n

  AbsorbedRows absorbed_;
  Vector difference_;  // S
};

// One line that names parameters, time, run and the solver's flag.
std::string DescribeFailure(const FailedTrajectory& failure, const Prior& prior);

}  // namespace polyest::internal
