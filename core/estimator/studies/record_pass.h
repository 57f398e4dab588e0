#pragma once

// Outputs of trajectories along a record, row by row, whitened as the rows are.

#include <absl/functional/function_ref.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <utility>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/learned_noise.h"
#include "core/estimator/record/row_block.h"
#include "polyest/samples.h"
#include "polyest/stop.h"

namespace polyest::internal {

class RecordPass {
 public:
  // Receives the next rows, all of one run, and the outputs there (column row · channels +
  // channel): one row for each trajectory, and then, if a delay is asked for, one for each channel,
  // which is the first trajectory with that channel late. Rows and outputs are white where the
  // noise is correlated. Outputs of a trajectory are NaN from its failure on.
  using Take = absl::FunctionRef<void(const RowBlock& rows, Matrix& outputs, bool begins_run)>;

  // `noise`: that of each channel. `problem` and `store` must outlive the pass.
  RecordPass(const ResolvedProblem& problem, const SampleStore& store,
             std::vector<ChannelNoise> noise, int threads)
      : problem_(problem), store_(store), noise_(std::move(noise)), threads_(threads) {}

  // Integrates the trajectories with parameters `thetas` (one in each row) over the first `rows`
  // rows. `late_s`: the delay, s; 0 for none. Returns an error only on a stop request, or of the
  // store.
  absl::Status Run(const Matrix& thetas, int64_t rows, double late_s, Take take,
                   const Stop& stop) const;

 private:
  struct RunOfModel;

  absl::Status ReadOfOneRun(int64_t first, int64_t rows, RowBlock& block) const;
  absl::StatusOr<Matrix> Outputs(const RowBlock& block, double late_s, RunOfModel& run,
                                 const Stop& stop) const;

  const ResolvedProblem& problem_;
  const SampleStore& store_;
  std::vector<ChannelNoise> noise_;
  int threads_;
};

}  // namespace polyest::internal
