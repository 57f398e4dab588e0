#include "server/sessions/session.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "server/convert/estimate.h"
#include "server/convert/measurements.h"
#include "server/convert/posterior.h"
#include "server/convert/problem.h"
#include "server/convert/regularization.h"

namespace polyest {

absl::StatusOr<std::shared_ptr<Session>> Session::Make(std::string name, v1::Problem problem,
                                                       google::protobuf::Timestamp create_time,
                                                       Executor& executor,
                                                       const ModelLibrary& models) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem resolved, ToProblem(problem, models));
  POLYEST_ASSIGN_OR_RETURN(auto estimator, Estimator::Make(std::move(resolved)));
  return std::shared_ptr<Session>(new Session(
      std::move(name), std::move(problem), std::move(create_time), std::move(estimator), executor));
}

Session::Session(std::string name, v1::Problem problem, google::protobuf::Timestamp create_time,
                 std::unique_ptr<Estimator> estimator, Executor& executor)
    : name_(std::move(name)),
      problem_(std::move(problem)),
      create_time_(std::move(create_time)),
      strand_(std::make_shared<Strand>(executor)),
      estimator_(std::move(estimator)) {
  for (const v1::MeasuredOutput& output : problem_.measured()) measured_.insert(output.output());
}

v1::Session Session::Describe() const {
  v1::Session session;
  session.set_name(name_);
  *session.mutable_problem() = problem_;
  *session.mutable_create_time() = create_time_;
  std::lock_guard lock(mutex_);
  session.set_last_sequence(sequence_.last());
  session.set_samples(samples_);
  session.set_last_time(last_row_.time_s);
  session.set_last_run(last_row_.run);
  return session;
}

int64_t Session::samples() const {
  std::lock_guard lock(mutex_);
  return samples_;
}

absl::Status Session::ClaimWriter(std::shared_ptr<SessionObserver> writer) {
  std::lock_guard lock(mutex_);
  if (closed_) return absl::NotFoundError(absl::StrCat(name_, " has been deleted"));
  if (writer_ != nullptr) {
    return absl::AbortedError(absl::StrCat(name_, " has a writer already; one at a time"));
  }
  writer_ = std::move(writer);
  return absl::OkStatus();
}

void Session::ReleaseWriter() {
  std::shared_ptr<SessionObserver> released;
  std::lock_guard lock(mutex_);
  released.swap(writer_);
}

void Session::Close() {
  std::vector<std::shared_ptr<SessionObserver>> observers;
  {
    std::lock_guard lock(mutex_);
    closed_ = true;
    observers.swap(observers_);
    if (writer_ != nullptr) observers.push_back(writer_);
  }
  for (const auto& observer : observers) observer->OnClosed();
}

absl::Status Session::CheckOpen() const {
  std::lock_guard lock(mutex_);
  if (closed_) return absl::NotFoundError(absl::StrCat(name_, " has been deleted"));
  return absl::OkStatus();
}

absl::StatusOr<v1::Acknowledgement> Session::Add(int64_t sequence, const v1::Measurements& batch) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  POLYEST_ASSIGN_OR_RETURN(const BatchSequence::Place place, sequence_.Check(sequence, batch));
  if (place == BatchSequence::Place::kNext) {
    POLYEST_ASSIGN_OR_RETURN(Samples samples, ToSamples(batch));
    POLYEST_RETURN_IF_ERROR(estimator_->Append(samples));
    std::lock_guard lock(mutex_);
    sequence_.Accept(batch);
    samples_ += CountValues(samples);
    if (samples.rows() > 0) {
      last_row_ = {samples.run.empty() ? 0 : samples.run.back(), samples.time_s.back()};
    }
  }
  return Acknowledge();
}

// Values of measured outputs that are there: what an estimate counts as its samples.
int64_t Session::CountValues(const Samples& samples) const {
  int64_t values = 0;
  for (const SampleColumn& column : samples.columns) {
    if (!measured_.contains(column.name)) continue;
    values += static_cast<int64_t>(column.value.size()) -
              std::count(column.missing.begin(), column.missing.end(), true);
  }
  return values;
}

v1::Acknowledgement Session::Acknowledge() const {
  v1::Acknowledgement acknowledgement;
  std::lock_guard lock(mutex_);
  acknowledgement.set_sequence(sequence_.last());
  acknowledgement.set_samples(samples_);
  return acknowledgement;
}

absl::Status Session::Process(const Stop& stop) { return estimator_->Process(stop); }

absl::StatusOr<SharedEstimate> Session::CurrentEstimate(const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  if (latest_ != nullptr && latest_->sequence() == sequence_.last()) return latest_;
  POLYEST_RETURN_IF_ERROR(Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const Estimate estimate, estimator_->CurrentEstimate(stop));
  auto latest = std::make_shared<v1::Estimate>(ToProto(estimate));
  latest->set_sequence(sequence_.last());
  latest_ = std::move(latest);
  std::vector<std::shared_ptr<SessionObserver>> observers;
  {
    std::lock_guard lock(mutex_);
    observers = observers_;
  }
  for (const auto& observer : observers) observer->OnEstimate(latest_);
  return latest_;
}

absl::StatusOr<v1::GetPosteriorResponse> Session::CurrentPosterior(
    const v1::GetPosteriorRequest& request, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  const PosteriorOptions options = ToPosteriorOptions(request);
  POLYEST_RETURN_IF_ERROR(options.Validate(estimator_->problem().prior()));
  POLYEST_RETURN_IF_ERROR(Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const Posterior posterior, estimator_->CurrentPosterior(options, stop));
  v1::GetPosteriorResponse response = ToProto(posterior, options);
  response.set_sequence(sequence_.last());
  return response;
}

absl::StatusOr<v1::ProfileCostResponse> Session::CurrentProfiles(
    const v1::ProfileCostRequest& request, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  const ProfileOptions options = ToProfileOptions(request);
  POLYEST_RETURN_IF_ERROR(options.Validate(estimator_->problem().prior()));
  POLYEST_RETURN_IF_ERROR(Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const CostProfiles profiles, estimator_->CurrentProfiles(options, stop));
  v1::ProfileCostResponse response = ToProto(profiles);
  response.set_sequence(sequence_.last());
  return response;
}

absl::StatusOr<v1::SweepRegularizationResponse> Session::CurrentRegularizationSweep(
    const v1::SweepRegularizationRequest& request, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  const RegularizationOptions options = ToRegularizationOptions(request);
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_RETURN_IF_ERROR(Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const RegularizationSweep sweep,
                           estimator_->CurrentRegularizationSweep(options, stop));
  v1::SweepRegularizationResponse response = ToProto(sweep);
  response.set_sequence(sequence_.last());
  return response;
}

absl::Status Session::Observe(std::shared_ptr<SessionObserver> observer, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  if (samples() > 0) {
    POLYEST_ASSIGN_OR_RETURN(const SharedEstimate present, CurrentEstimate(stop));
    observer->OnEstimate(present);
  }
  std::lock_guard lock(mutex_);
  if (closed_) return absl::NotFoundError(absl::StrCat(name_, " has been deleted"));
  observers_.push_back(std::move(observer));
  return absl::OkStatus();
}

void Session::Unobserve(const SessionObserver* observer) {
  std::lock_guard lock(mutex_);
  std::erase_if(observers_, [&](const auto& one) { return one.get() == observer; });
}

bool Session::observed() const {
  std::lock_guard lock(mutex_);
  return !observers_.empty();
}

}  // namespace polyest
