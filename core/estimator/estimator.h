#pragma once

// The streaming estimator: append measurements, process them, estimate when asked.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/common/stop.h"
#include "core/estimator/cost_profile.h"
#include "core/estimator/estimate.h"
#include "core/estimator/posterior_study.h"
#include "core/estimator/problem.h"
#include "core/estimator/regularization_sweep.h"
#include "core/estimator/samples.h"

namespace polyest {

// All that an estimator has made of the first rows of a record.
struct EstimatorSnapshot {
  int64_t rows = 0;
  std::string state;  // for Estimator::Restore
};

struct EstimatorOptions {
  int threads = 1;  // for propagation; results do not depend on it
  // Where samples are kept, empty at first; in memory when null.
  std::shared_ptr<SampleStore> store;
  // Called by Process, if given, once at each checkpoint of the record that it comes to: after
  // every IntegrationOptions::samples_between_checkpoints rows of a run, and before a new run once
  // so many rows have passed since the checkpoint before. A model that simulates itself has only
  // the latter. It changes no answer.
  std::function<void(EstimatorSnapshot)> snapshot;
};

class Estimator {
 public:
  // INVALID_ARGUMENT when `problem` measures nothing or an option is out of range;
  // FAILED_PRECONDITION when its expansion cannot be factored or the store is not empty.
  static absl::StatusOr<std::unique_ptr<Estimator>> Make(ResolvedProblem problem,
                                                         EstimatorOptions options = {});
  ~Estimator();

  // For the runs appended.
  const ResolvedProblem& problem() const;

  // Checks the whole of `samples` and stores all of it or, when anything is wrong, nothing.
  // INVALID_ARGUMENT names row, column, value and rule. Cheap: no numerics.
  absl::Status Append(const Samples& samples);

  // Takes every stored sample not yet taken into the sums, re-expanding where needed; the last few
  // rows of a run with a smooth streamed input wait for the rows after them or for the run's end
  // (Samples::end_of_run), since its curve up to them depends on what follows. On a stop
  // request returns its status; what was taken stays, the next call goes on from there.
  absl::Status Process(const Stop& stop = {});

  // Goes to where the estimator was that the snapshot is of, at a fraction of the cost of its rows:
  // every later answer has the same bits as that one's. For an estimator of the same problem to
  // which the same rows have been appended, and maybe more, and none of them processed. Otherwise,
  // and for a snapshot of another version, FAILED_PRECONDITION; DATA_LOSS for bytes cut off,
  // corrupted or inconsistent. The estimator is then unchanged and may process its rows itself.
  absl::Status Restore(const EstimatorSnapshot& snapshot);

  // The estimate from all samples processed. Does not change the estimator: how often it is asked
  // never changes a later answer. Its cost does not depend on the number of samples.
  absl::StatusOr<Estimate> CurrentEstimate(const Stop& stop = {}) const;

  // The posterior of the same samples in detail. INVALID_ARGUMENT as PosteriorOptions::Validate.
  absl::StatusOr<Posterior> CurrentPosterior(const PosteriorOptions& options,
                                             const Stop& stop = {}) const;

  // The profiles of the cost of the same samples. INVALID_ARGUMENT as ProfileOptions::Validate.
  absl::StatusOr<CostProfiles> CurrentProfiles(const ProfileOptions& options,
                                               const Stop& stop = {}) const;

  // The minima of the same samples' cost over α². INVALID_ARGUMENT as
  // RegularizationOptions::Validate.
  absl::StatusOr<RegularizationSweep> CurrentRegularizationSweep(
      const RegularizationOptions& options, const Stop& stop = {}) const;

  int64_t rows_appended() const;
  int64_t rows_processed() const;

 private:
  class Implementation;
  explicit Estimator(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace polyest
