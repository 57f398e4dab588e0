#pragma once

#include <absl/status/status.h>

#include <span>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/pending_samples.h"
#include "core/propagation/filter_bank.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Estimates the outputs at instants of a run from all its samples, earlier and later ones, by the
// smoother of backward_pass.h. The arguments are those of RunFilters (run_filters.h).
class RunSmoothers {
 public:
  RunSmoothers(const ResolvedProblem& problem, const Matrix& thetas,
               const std::vector<int>& outputs, int run, const InputSignals* inputs, int threads);

  // Marks an instant; times do not decrease. Fails on a stop request only.
  absl::Status Mark(double time_s, const Stop& stop);
  // Takes the samples at a time, as PendingSamples::Add.
  void Take(double time_s, std::span<const double> samples, std::span<const double> noise) {
    pending_.Add(time_s, samples, noise);
  }
  // Ends the run. Fails on a stop request only.
  absl::Status Finish(const Stop& stop);
  // Writes the means and standard deviations of the outputs at the i-th mark (filters × outputs);
  // NaN for filters that failed anywhere in the run. Fails if the model's code is lost.
  absl::Status Read(size_t mark, MatrixRef means, MatrixRef deviations);
  // Writes the scores of abrupt changes (backward_pass.h) at the i-th mark of outputs that are
  // parameters that drift (filters × outputs); 0 for other outputs.
  void ReadJumpScores(size_t mark, MatrixRef scores) const;

  const std::vector<PointFailure>& failures() const { return filters_.failures(); }

 private:
  const Eigen::Index asked_;
  std::vector<int> walks_;  // the state of each output asked for that drifts, else −1
  FilterBank filters_;
  PendingSamples pending_;
  std::vector<double> marks_s_;
};

}  // namespace polyest::internal
