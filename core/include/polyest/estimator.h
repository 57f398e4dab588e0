#pragma once

// The streaming estimator: append measurements, process them, estimate when asked.
//
//   polyest::Problem problem;
//   problem.model = polyest::FindBuiltinModel("mass_spring_damper").value();
//   problem.uncertain = {polyest::UncertainParameter::Uniform("k", 30, 50).value()};
//   problem.measured = {{.output = "x", .noise = {.absolute = 0.01}}};
//   auto estimator = polyest::Estimator::Make(problem).value();
//   estimator->Append(samples);     // as often as there are new ones
//   estimator->Process();
//   polyest::Estimate estimate = estimator->CurrentEstimate().value();

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "polyest/cost_profile.h"
#include "polyest/estimate.h"
#include "polyest/posterior.h"
#include "polyest/problem.h"
#include "polyest/regularization.h"
#include "polyest/samples.h"
#include "polyest/stop.h"

namespace polyest {

namespace internal {
class EstimatorAccess;
}

// All that an estimator has made of the first rows of a record.
struct EstimatorSnapshot {
  int64_t rows = 0;   // how many rows
  std::string state;  // for Estimator::Restore; a binary format of this version of polyest
};

// How an estimator works.
struct EstimatorOptions {
  int threads = 1;  // ≥ 1, for model runs; results do not depend on it
  // Where samples are kept, empty at first; in memory when null.
  std::shared_ptr<SampleStore> store;
  // Called by Process, if given, once at each checkpoint of the record that it comes to: after
  // every IntegrationOptions::samples_between_checkpoints rows of a run, and before a new run once
  // so many rows have passed since the checkpoint before. A model that simulates itself has only
  // the latter. It changes no answer.
  std::function<void(EstimatorSnapshot)> snapshot;
};

// An estimator of one problem, for one thread at a time.
class Estimator {
 public:
  // Makes an estimator. INVALID_ARGUMENT or RESOURCE_EXHAUSTED name the field of `problem` or
  // `options`, its value and the rule (an unknown name is answered with the names there are);
  // FAILED_PRECONDITION when the problem's expansion cannot be computed or the store is not empty.
  static absl::StatusOr<std::unique_ptr<Estimator>> Make(Problem problem,
                                                         EstimatorOptions options = {});
  ~Estimator();

  // The problem that is estimated.
  const Problem& problem() const;

  // Checks the whole of `samples` and stores all of it or, when anything is wrong, nothing.
  // INVALID_ARGUMENT names row, column, value and rule. Cheap: no numerics.
  absl::Status Append(const Samples& samples);

  // Takes every stored sample not yet taken, expanding again where needed; the last few rows of a
  // run with a smooth streamed input wait for the rows after them or for the run's end
  // (Samples::end_of_run), since its curve up to them depends on what follows. On a stop request
  // returns its status; what was taken stays, and the next call goes on from there.
  absl::Status Process(const Stop& stop = {});

  // Restores the estimator to the state saved in `snapshot`, at a fraction of the cost of its rows:
  // every later answer has the same bits as without. For an estimator of the same problem to which
  // the same rows have been appended, and maybe more, and none of them processed. Otherwise, and
  // for a snapshot of another version, FAILED_PRECONDITION; DATA_LOSS for bytes cut off, corrupted
  // or inconsistent. The estimator is then unchanged and may process its rows itself.
  absl::Status Restore(const EstimatorSnapshot& snapshot);

  // Returns the estimate from all samples processed. Does not change the estimator: how often it is
  // asked never changes a later answer. Its cost does not depend on the number of samples. Not OK
  // only on a stop request.
  absl::StatusOr<Estimate> CurrentEstimate(const Stop& stop = {}) const;

  // Returns the posterior of the same samples in detail. INVALID_ARGUMENT names the option, its
  // value and the rule.
  absl::StatusOr<Posterior> CurrentPosterior(const PosteriorOptions& options,
                                             const Stop& stop = {}) const;

  // Returns the profiles of the cost of the same samples. INVALID_ARGUMENT names the option, its
  // value and the rule.
  absl::StatusOr<CostProfiles> CurrentProfiles(const ProfileOptions& options,
                                               const Stop& stop = {}) const;

  // Returns the minima of the same samples' cost over α². INVALID_ARGUMENT names the option, its
  // value and the rule.
  absl::StatusOr<RegularizationSweep> CurrentRegularizationSweep(
      const RegularizationOptions& options, const Stop& stop = {}) const;

  // The number of rows appended.
  int64_t rows_appended() const;
  // The number of rows that answers are of.
  int64_t rows_processed() const;

 private:
  friend class internal::EstimatorAccess;
  class Implementation;
  explicit Estimator(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace polyest
