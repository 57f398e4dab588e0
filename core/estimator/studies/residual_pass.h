#pragma once

// Residuals of an estimate along its record, in units of their noise, and how trajectories beside
// that of the estimate differ from it.

#include <absl/functional/function_ref.h>
#include <absl/status/status.h>

#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/learned_noise.h"
#include "core/estimator/studies/record_pass.h"
#include "polyest/stop.h"

namespace polyest::internal {

class ResidualPass {
 public:
  // Receives the values of the next rows of one run (column row · channels + channel): row 0 holds
  // the residuals (z − y)/σ of the first trajectory, row i the differences (y_i − y)/σ of the
  // others, and a further row for each channel the difference that a delay of it by `late_s` makes,
  // if that is not 0. Where there is no sample, all are 0. Those of a trajectory that fails are
  // NaN.
  using Take = absl::FunctionRef<void(const Matrix& values, bool begins_run)>;

  // Correlated noise is whitened with `noise`, that of each channel. `problem` and `store` must
  // outlive the pass.
  ResidualPass(const ResolvedProblem& problem, const SampleStore& store,
               const std::vector<ChannelNoise>& noise)
      : problem_(problem), pass_(problem, store, noise, /*threads=*/1) {}

  // Integrates the trajectories with parameters `thetas` (one in each row) over the first `rows`
  // rows. Returns an error only on a stop request, or of the store.
  absl::Status Run(const Matrix& thetas, int64_t rows, double late_s, Take take,
                   const Stop& stop) const;

 private:
  void Compare(const RowBlock& block, Matrix& outputs) const;

  const ResolvedProblem& problem_;
  RecordPass pass_;
};

}  // namespace polyest::internal
