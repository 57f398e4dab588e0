#pragma once

// What of a session is in memory only while it is used: its problem and its estimator.

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <set>
#include <string>

#include "core/common/stop.h"
#include "core/estimator/estimator.h"
#include "core/fmu/model_library.h"
#include "polyest/v1/estimation_service.pb.h"
#include "server/convert/problem_limits.h"
#include "server/journal/session_journal.h"

namespace polyest {

using SharedEstimate = std::shared_ptr<const v1::Estimate>;

// For one thread at a time.
class LoadedSession {
 public:
  // INVALID_ARGUMENT or RESOURCE_EXHAUSTED as the problem deserves.
  static absl::StatusOr<std::unique_ptr<LoadedSession>> Make(v1::Problem problem,
                                                             const ModelLibrary& models,
                                                             const ProblemLimits& limits = {});
  // As it was after the batches that the journal keeps, from its latest snapshot on if that is of
  // use. DATA_LOSS when they do not lead to `place`.
  static absl::StatusOr<std::unique_ptr<LoadedSession>> Load(const SessionJournal& journal,
                                                             int64_t session,
                                                             const SessionPlace& place,
                                                             const ModelLibrary& models,
                                                             const Stop& stop);

  // From here on the journal is given the estimator's snapshots of this session.
  void SaveSnapshots(SessionJournal& journal, int64_t session);

  const v1::Problem& problem() const { return problem_; }
  // What the session has taken.
  const SessionPlace& place() const { return place_; }
  // Seconds of measurements appended, over all runs.
  double measured_s() const { return measured_s_; }
  const ResolvedProblem& resolved() const { return estimator_->problem(); }
  // Takes the next batch, all of it or nothing; INVALID_ARGUMENT when it is no good. Cheap.
  absl::Status Append(const v1::Measurements& batch);

  absl::Status Process(const Stop& stop) { return estimator_->Process(stop); }
  // From everything appended, and made only once for it.
  absl::StatusOr<SharedEstimate> CurrentEstimate(const Stop& stop);
  absl::StatusOr<v1::GetPosteriorResponse> CurrentPosterior(const v1::GetPosteriorRequest& request,
                                                            const Stop& stop);
  absl::StatusOr<v1::ProfileCostResponse> CurrentProfiles(const v1::ProfileCostRequest& request,
                                                          const Stop& stop);
  absl::StatusOr<v1::SweepRegularizationResponse> CurrentRegularizationSweep(
      const v1::SweepRegularizationRequest& request, const Stop& stop);

 private:
  explicit LoadedSession(v1::Problem problem);
  void Restore(const SessionJournal& journal, int64_t session);
  int64_t CountValues(const Samples& samples) const;
  void Advance(const Samples& samples);

  const v1::Problem problem_;
  std::set<std::string> measured_;
  std::unique_ptr<Estimator> estimator_;
  std::function<void(EstimatorSnapshot)> save_;
  SessionPlace place_;
  double measured_s_ = 0;
  SharedEstimate latest_;
};

}  // namespace polyest
