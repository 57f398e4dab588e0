#pragma once

// Where the batches of a session come in: checked at once, so that they can be acknowledged, and
// held until the estimator, which may be busy for a while, takes them.

#include <absl/status/status.h>

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/sample_checks.h"
#include "polyest/samples.h"
#include "polyest/v1/measurements.pb.h"
#include "proto/wire/convert/problem_limits.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

struct TakenBatch {
  Samples samples;
  SessionPlace place;     // after it
  double measured_s = 0;  // after it, s of measurements over all runs
};

// Threads may share it.
class BatchIntake {
 public:
  explicit BatchIntake(ResolvedProblem problem);

  // Without parameters for runs other than the first.
  const ResolvedProblem& problem() const { return problem_; }
  // After the last batch taken.
  SessionPlace place() const;
  double measured_s() const;

  // Takes the next batch, all of it or nothing; INVALID_ARGUMENT when it is no good,
  // RESOURCE_EXHAUSTED when its runs bring more parameters than the limits allow. What passes here
  // an estimator of the problem takes, too. Cheap.
  absl::Status Take(const v1::Measurements& batch, const ProblemLimits& limits = {});

  // The first batch not handed on yet, if its number is not above `sequence`.
  std::optional<TakenBatch> Next(int64_t sequence);

 private:
  absl::Status CheckRuns(int runs, const ProblemLimits& limits);
  int64_t CountValues(const Samples& samples) const;
  void Advance(const Samples& samples);

  const ResolvedProblem problem_;
  std::set<std::string> measured_;

  mutable std::mutex mutex_;
  SampleChecks checks_;
  int runs_;  // for which the problem is known to be good
  SessionPlace place_;
  double measured_s_ = 0;
  std::deque<TakenBatch> waiting_;
};

}  // namespace polyest::internal
