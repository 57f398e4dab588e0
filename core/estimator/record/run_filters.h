#pragma once

// What filters predict along one run, for given values of the uncertain parameters: the outputs at
// each instant from the samples before it, in windows within which no sample is used.

#include <absl/status/status.h>

#include <span>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/pending_samples.h"
#include "core/propagation/filter_bank.h"
#include "polyest/stop.h"

namespace polyest::internal {

class RunFilters {
 public:
  // One filter for each row of `thetas` in the run; `outputs` are columns of the model's outputs.
  // `inputs` must outlive it. A window ends with the last sample within `horizon_s` ≥ 0 of the
  // sample it begins after; with 0 each sample is predicted from all samples before it.
  RunFilters(const ResolvedProblem& problem, const Matrix& thetas, const std::vector<int>& outputs,
             int run, const InputSignals* inputs, double horizon_s, int threads);

  // Predicts the outputs at a time, which is not before the last one: the means and the standard
  // deviations, filters × outputs. NaN for filters that failed. Fails on a stop request only.
  absl::Status Predict(double time_s, MatrixRef means, MatrixRef deviations, const Stop& stop);
  // Takes the samples of the measured outputs at the time predicted last, as PendingSamples::Add.
  void Take(double time_s, std::span<const double> samples, std::span<const double> noise) {
    pending_.Add(time_s, samples, noise);
  }

  const std::vector<PointFailure>& failures() const { return ahead_.failures(); }

 private:
  absl::Status EndWindow(const Stop& stop);

  const Eigen::Index asked_;
  const double horizon_s_;
  double window_start_s_ = 0;
  FilterBank behind_;       // has taken all samples up to the window's beginning
  FilterBank ahead_;        // predicts from there
  PendingSamples pending_;  // of the window
};

}  // namespace polyest::internal
