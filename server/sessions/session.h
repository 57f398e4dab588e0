#pragma once

// An estimator that lives between calls, the numbers of its batches, its latest estimate and those
// who watch it.

#include <absl/status/statusor.h>
#include <google/protobuf/timestamp.pb.h>

#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "core/common/stop.h"
#include "core/estimator/estimator.h"
#include "core/fmu/model_library.h"
#include "polyest/v1/estimation_service.pb.h"
#include "server/execution/executor.h"
#include "server/sessions/batch_sequence.h"

namespace polyest {

using SharedEstimate = std::shared_ptr<const v1::Estimate>;

// Called from the session's strand, or from whoever closes it; must not wait.
class SessionObserver {
 public:
  virtual ~SessionObserver() = default;
  virtual void OnEstimate(const SharedEstimate& estimate) = 0;
  // The last call.
  virtual void OnClosed() = 0;
};

class Session {
 public:
  // INVALID_ARGUMENT or RESOURCE_EXHAUSTED as the problem deserves.
  static absl::StatusOr<std::shared_ptr<Session>> Make(std::string name, v1::Problem problem,
                                                       google::protobuf::Timestamp create_time,
                                                       Executor& executor,
                                                       const ModelLibrary& models = {});

  const std::string& name() const { return name_; }
  Strand& strand() { return *strand_; }

  // From any thread.
  v1::Session Describe() const;
  int64_t samples() const;

  // One writer at a time: ABORTED while another has it. A writer hears of the closing only.
  absl::Status ClaimWriter(std::shared_ptr<SessionObserver> writer);
  void ReleaseWriter();

  // Ends the session for everybody: calls on it are NOT_FOUND from here on.
  void Close();

  // The following only on the strand.

  // Takes the batch, all of it or nothing, and acknowledges it. No numerics: Process does them.
  absl::StatusOr<v1::Acknowledgement> Add(int64_t sequence, const v1::Measurements& batch);
  absl::Status Process(const Stop& stop);
  // The estimate from everything added. A new one is passed on to the observers.
  absl::StatusOr<SharedEstimate> CurrentEstimate(const Stop& stop);
  // The posterior in detail, from everything added.
  absl::StatusOr<v1::GetPosteriorResponse> CurrentPosterior(const v1::GetPosteriorRequest& request,
                                                            const Stop& stop);
  absl::StatusOr<v1::ProfileCostResponse> CurrentProfiles(const v1::ProfileCostRequest& request,
                                                          const Stop& stop);
  absl::StatusOr<v1::SweepRegularizationResponse> CurrentRegularizationSweep(
      const v1::SweepRegularizationRequest& request, const Stop& stop);
  // Passes on the present estimate, if there are samples, and every new one from here on.
  absl::Status Observe(std::shared_ptr<SessionObserver> observer, const Stop& stop);
  void Unobserve(const SessionObserver* observer);
  bool observed() const;

 private:
  Session(std::string name, v1::Problem problem, google::protobuf::Timestamp create_time,
          std::unique_ptr<Estimator> estimator, Executor& executor);

  absl::Status CheckOpen() const;
  int64_t CountValues(const Samples& samples) const;
  v1::Acknowledgement Acknowledge() const;

  const std::string name_;
  const v1::Problem problem_;
  const google::protobuf::Timestamp create_time_;
  const std::shared_ptr<Strand> strand_;
  std::set<std::string> measured_;

  // The strand's own.
  std::unique_ptr<Estimator> estimator_;
  SharedEstimate latest_;

  mutable std::mutex mutex_;
  // Changed on the strand only, under the mutex; read anywhere.
  BatchSequence sequence_;
  int64_t samples_ = 0;
  SampleRow last_row_;
  bool closed_ = false;
  std::shared_ptr<SessionObserver> writer_;
  std::vector<std::shared_ptr<SessionObserver>> observers_;
};

}  // namespace polyest
