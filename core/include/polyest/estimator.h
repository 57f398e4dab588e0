#pragma once

// The streaming estimator: append measurements, process them, estimate when asked.
//
//   polyest::Problem problem;
//   problem.model = polyest::FindBuiltinModel("mass_spring_damper").value();
//   problem.uncertain = {polyest::UncertainParameter::Uniform("k", 30, 50).value()};
//   problem.measured = {{.output = "x", .noise = {.absolute = 0.01}}};
//   auto estimator = polyest::Estimator::Make(problem).value();
//   absl::Status status = estimator->Append(samples);  // as often as there are new ones
//   status.Update(estimator->Process());
//   absl::StatusOr<polyest::Estimate> estimate = estimator->CurrentEstimate();

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "polyest/cost_profile.h"
#include "polyest/estimate.h"
#include "polyest/log_density.h"
#include "polyest/posterior.h"
#include "polyest/prediction.h"
#include "polyest/problem.h"
#include "polyest/regularization.h"
#include "polyest/samples.h"
#include "polyest/stop.h"

namespace polyest {

namespace internal {
class EstimatorAccess;
}

// The state of an estimator after the first rows of a record.
struct EstimatorSnapshot {
  int64_t rows = 0;   // number of rows
  std::string state;  // for Estimator::Restore; a binary format of this version of polyest
};

// How an estimator works.
struct EstimatorOptions {
  int threads = 1;  // ≥ 1; results do not depend on it
  // Where samples are kept, empty at first; in memory when null.
  std::shared_ptr<SampleStore> store;
  // Called by Process, if given, once at each checkpoint of the record: after every
  // IntegrationOptions::samples_between_checkpoints rows of a run, and before a new run if as many
  // rows have passed since the checkpoint before. A model that simulates itself (an FMU) and
  // a problem with delays of outputs have checkpoints before new runs only. The function does not
  // change any answer.
  std::function<void(EstimatorSnapshot)> snapshot;
};

// An estimator of one problem. Use it from one thread at a time.
class Estimator {
 public:
  // Makes an estimator. INVALID_ARGUMENT and RESOURCE_EXHAUSTED name the field of `problem` or
  // `options`, its value and the rule; an unknown name is answered with the known ones.
  // FAILED_PRECONDITION if the problem's expansion cannot be computed or the store is not empty. On
  // a stop request returns its status: thousands of collocation points take seconds to factor.
  static absl::StatusOr<std::unique_ptr<Estimator>> Make(Problem problem,
                                                         EstimatorOptions options = {},
                                                         const Stop& stop = {});
  ~Estimator();

  // The problem that is estimated.
  const Problem& problem() const;

  // Checks `samples` and stores all of them or, if anything is wrong, nothing. INVALID_ARGUMENT
  // names row, column, value and rule. Cheap: it computes nothing.
  absl::Status Append(const Samples& samples);

  // Processes all stored samples that are not processed yet, and expands the outputs again where
  // needed. The last rows of a run with a streamed input wait until later samples of it settle its
  // curve, or until the run ends (Samples::end_of_run). On a stop request returns its status;
  // the next call goes on from there. FAILED_PRECONDITION if too few trajectories of the model can
  // be integrated, or the posterior has too few values of finite cost to draw from.
  absl::Status Process(const Stop& stop = {});

  // Restores the estimator to the state saved in `snapshot`, much faster than processing the rows.
  // Every later answer has the same bits as without. The estimator must be of the same problem,
  // with the same rows appended (or more) and none processed; otherwise FAILED_PRECONDITION, as for
  // a snapshot of another version. DATA_LOSS if bytes are cut off, corrupted or inconsistent. On a
  // stop request returns its status. After an error the estimator is unchanged and can process its
  // rows itself.
  absl::Status Restore(const EstimatorSnapshot& snapshot, const Stop& stop = {});

  // Returns the estimate from all processed samples. It does not change the estimator, so how often
  // it is called never changes a later answer. Its time does not depend on the number of samples.
  // Not OK on a stop request; FAILED_PRECONDITION if the posterior has too few values of finite
  // cost to draw from.
  absl::StatusOr<Estimate> CurrentEstimate(const Stop& stop = {}) const;

  // Returns the same estimate, with FIXED_VALUE_CONFLICT if its residuals ask for another value
  // of a parameter, an initial state, a gain, a delay or an offset that the problem holds fixed;
  // parameters that this would move are then kWeak at most. To tell that, the model runs again
  // along the record, its first 65,536 rows at most. Not OK on a stop request or an error of the
  // store; otherwise as CurrentEstimate.
  absl::StatusOr<Estimate> TestedEstimate(const Stop& stop = {}) const;

  // Returns the posterior of the same samples in detail. INVALID_ARGUMENT names the option, its
  // value and the rule; otherwise as CurrentEstimate.
  absl::StatusOr<Posterior> CurrentPosterior(const PosteriorOptions& options,
                                             const Stop& stop = {}) const;

  // Returns the profiles of the cost of the same samples. INVALID_ARGUMENT names the option, its
  // value and the rule; otherwise as CurrentEstimate.
  absl::StatusOr<CostProfiles> CurrentProfiles(const ProfileOptions& options,
                                               const Stop& stop = {}) const;

  // Returns the posterior density and the likelihood of the same samples at given parameters, from
  // the expansion: as often as wanted, since only the first call after new samples takes the time
  // of an estimate. INVALID_ARGUMENT names the option, its value and the rule, or the point outside
  // of the prior's support or too far from the posterior; RESOURCE_EXHAUSTED for an answer that is
  // too large; otherwise as CurrentEstimate.
  absl::StatusOr<LogDensity> CurrentLogDensity(const LogDensityOptions& options,
                                               const Stop& stop = {}) const;

  // Returns the minima of the same samples' cost for several α². INVALID_ARGUMENT names the option,
  // its value and the rule; otherwise as CurrentEstimate.
  absl::StatusOr<RegularizationSweep> CurrentRegularizationSweep(
      const RegularizationOptions& options, const Stop& stop = {}) const;

  // Returns what the posterior of the same samples predicts for the signals, over the processed
  // rows or another record. INVALID_ARGUMENT names the option, its value and the rule, or of the
  // other record the row and the column; RESOURCE_EXHAUSTED for an answer that is too large;
  // FAILED_PRECONDITION if too few of its trajectories can be integrated; otherwise as
  // CurrentEstimate.
  absl::StatusOr<Prediction> CurrentPrediction(const PredictionOptions& options,
                                               const Stop& stop = {}) const;

  // The number of rows appended.
  int64_t rows_appended() const;
  // The number of rows processed, from which answers are computed.
  int64_t rows_processed() const;

 private:
  friend class internal::EstimatorAccess;
  class Implementation;
  explicit Estimator(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace polyest
