#pragma once

// Trajectories of the model over a record, for given values of the uncertain parameters, or what
// filters predict along it. Beside the record's rows, outputs may be asked for at other times.

#include <absl/functional/function_ref.h>
#include <absl/status/status.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/run_filters.h"
#include "core/estimator/record/run_inputs.h"
#include "core/estimator/record/run_smoothers.h"
#include "core/propagation/ensemble_propagator.h"
#include "polyest/samples.h"
#include "polyest/stop.h"

namespace polyest::internal {

// A time at which trajectories have outputs.
struct TrajectoryInstant {
  SampleRow place;
  int64_t row = -1;  // of the record; −1 for a time asked for
  // The row's samples, one for each measured output, NaN where missing; empty for a time asked for.
  std::span<const double> samples;
  std::span<const double> noise;  // standard deviations of their noise
  // The scores of abrupt changes (trajectories × outputs), RunSmoothers::ReadJumpScores, if
  // smoothed; else null.
  const Matrix* jump_scores = nullptr;
};

// How filters are used, if there are any.
struct FilterUse {
  double horizon_s = 0;  // as that of RunFilters
  // Whether outputs are told from all samples of their run, also those after them (RunSmoothers).
  // Only the rows for which `visits` returns true are visited then, and each run's at its end.
  bool smooth = false;
  std::function<bool(int64_t row)> visits;
};

class RecordTrajectories {
 public:
  // Receives the outputs at an instant, trajectories × outputs; NaN from a trajectory's failure on.
  // With filters they are the means of normal distributions with these standard deviations, which
  // are empty without.
  using Visit = absl::FunctionRef<absl::Status(
      const TrajectoryInstant&, const ConstMatrixRef& outputs, const ConstMatrixRef& deviations)>;

  // `thetas`: one trajectory for each row, trajectories × n. `outputs`: columns of the model's
  // outputs. `problem` and `store` must outlive the trajectories.
  RecordTrajectories(const ResolvedProblem& problem, const SampleStore& store, Matrix thetas,
                     std::vector<int> outputs, FilterUse filter_use, int threads);

  // Integrates over the first `rows` ≥ 1 rows, and visits every row and every time of `times`, in
  // time order. Returns InvalidArgument that names the element if `times` is not in time order,
  // names a run without rows, or lies after the last row of a run with streamed inputs. Otherwise
  // returns an error only on a stop request or of `visit`.
  absl::Status Run(int64_t rows, std::span<const SampleRow> times, Visit visit, const Stop& stop);

  // The number of trajectories that failed in any run.
  int failed() const;

 private:
  absl::Status CheckTimes(std::span<const SampleRow> times) const;
  void StartRun(int run, int64_t first_row);
  absl::Status FinishRun(Visit visit, const Stop& stop);
  absl::Status Advance(const RowBlock& block, int first, int count, int64_t row, Visit visit,
                       const Stop& stop);
  absl::Status VisitAll(std::span<const TrajectoryInstant> instants, Visit visit, const Stop& stop);
  absl::Status FilterAll(std::span<const TrajectoryInstant> instants, Visit visit,
                         const Stop& stop);
  absl::Status MarkAll(std::span<const TrajectoryInstant> instants, const Stop& stop);
  absl::Status VisitMarked(Visit visit, const Stop& stop);
  const std::vector<PointFailure>& RunFailures() const;

  // An instant to be visited at the end of its run.
  struct Marked {
    TrajectoryInstant instant;  // without samples
    std::vector<double> samples, noise;
  };

  const ResolvedProblem& problem_;
  const SampleStore& store_;
  Matrix thetas_;
  std::vector<int> outputs_;
  FilterUse filter_use_;
  int threads_;

  int run_ = -1;
  std::unique_ptr<RunInputs> inputs_;               // of the present run
  std::unique_ptr<EnsemblePropagator> propagator_;  // one of these three
  std::unique_ptr<RunFilters> filters_;
  std::unique_ptr<RunSmoothers> smoothers_;
  std::vector<Marked> marked_;  // of the present run
  std::vector<bool> failed_;    // by trajectory
  std::span<const SampleRow> times_;
  size_t next_time_ = 0;  // the first of `times_` not visited yet
};

}  // namespace polyest::internal
