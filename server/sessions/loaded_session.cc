#include "server/sessions/loaded_session.h"

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "server/convert/estimate.h"
#include "server/convert/measurements.h"
#include "server/convert/posterior.h"
#include "server/convert/regularization.h"

namespace polyest {

absl::StatusOr<std::unique_ptr<LoadedSession>> LoadedSession::Make(v1::Problem problem,
                                                                   const ModelLibrary& models,
                                                                   const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem resolved, ToProblem(problem, models, limits));
  std::unique_ptr<LoadedSession> loaded(new LoadedSession(std::move(problem)));
  EstimatorOptions options;
  options.snapshot = [session = loaded.get()](EstimatorSnapshot snapshot) {
    if (session->save_) session->save_(std::move(snapshot));
  };
  POLYEST_ASSIGN_OR_RETURN(loaded->estimator_,
                           Estimator::Make(std::move(resolved), std::move(options)));
  return loaded;
}

void LoadedSession::SaveSnapshots(SessionJournal& journal, int64_t session) {
  save_ = [this, &journal, session](EstimatorSnapshot snapshot) {
    journal.SaveSnapshot(session, {place_.sequence, snapshot.rows, std::move(snapshot.state)});
  };
}

// A snapshot only saves time: one that is of no use is not missed.
void LoadedSession::Restore(const SessionJournal& journal, int64_t session) {
  auto snapshot = journal.ReadSnapshot(session);
  if (!snapshot.ok() || !snapshot->has_value()) return;
  estimator_->Restore({(*snapshot)->rows, std::move((*snapshot)->state)}).IgnoreError();
}

absl::StatusOr<std::unique_ptr<LoadedSession>> LoadedSession::Load(const SessionJournal& journal,
                                                                   int64_t session,
                                                                   const SessionPlace& place,
                                                                   const ModelLibrary& models,
                                                                   const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(v1::Problem problem, journal.ReadProblem(session));
  POLYEST_ASSIGN_OR_RETURN(auto loaded, Make(std::move(problem), models));
  const auto append = [&](const JournalBatch& batch) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    return loaded->Append(batch.measurements);
  };
  POLYEST_RETURN_IF_ERROR(journal.ReadBatches(session, 0, append));
  if (loaded->place_.sequence != place.sequence || loaded->place_.rows != place.rows) {
    return absl::DataLossError("the last batches of the session are missing in the journal");
  }
  loaded->Restore(journal, session);
  return loaded;
}

LoadedSession::LoadedSession(v1::Problem problem) : problem_(std::move(problem)) {
  for (const v1::MeasuredOutput& output : problem_.measured()) measured_.insert(output.output());
}

absl::Status LoadedSession::Append(const v1::Measurements& batch) {
  POLYEST_ASSIGN_OR_RETURN(const Samples samples, ToSamples(batch));
  POLYEST_RETURN_IF_ERROR(estimator_->Append(samples));
  Advance(samples);
  return absl::OkStatus();
}

void LoadedSession::Advance(const Samples& samples) {
  ++place_.sequence;
  place_.samples += CountValues(samples);
  place_.rows += static_cast<int64_t>(samples.rows());
  for (size_t row = 0; row < samples.rows(); ++row) {
    const SampleRow next{samples.run.empty() ? 0 : samples.run[row], samples.time_s[row]};
    const bool same_run = next.run == place_.last_row.run;
    measured_s_ += next.time_s - (same_run ? place_.last_row.time_s : 0);
    place_.last_row = next;
  }
}

// Values of measured outputs that are there: what an estimate counts as its samples.
int64_t LoadedSession::CountValues(const Samples& samples) const {
  int64_t values = 0;
  for (const SampleColumn& column : samples.columns) {
    if (!measured_.contains(column.name)) continue;
    values += static_cast<int64_t>(column.value.size()) -
              std::count(column.missing.begin(), column.missing.end(), true);
  }
  return values;
}

absl::StatusOr<SharedEstimate> LoadedSession::CurrentEstimate(const Stop& stop) {
  if (latest_ != nullptr && latest_->sequence() == place_.sequence) return latest_;
  POLYEST_RETURN_IF_ERROR(Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const Estimate estimate, estimator_->CurrentEstimate(stop));
  auto latest = std::make_shared<v1::Estimate>(ToProto(estimate));
  latest->set_sequence(place_.sequence);
  latest_ = std::move(latest);
  return latest_;
}

absl::StatusOr<v1::GetPosteriorResponse> LoadedSession::CurrentPosterior(
    const v1::GetPosteriorRequest& request, const Stop& stop) {
  const PosteriorOptions options = ToPosteriorOptions(request);
  POLYEST_RETURN_IF_ERROR(options.Validate(estimator_->problem().prior()));
  POLYEST_RETURN_IF_ERROR(Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const Posterior posterior, estimator_->CurrentPosterior(options, stop));
  v1::GetPosteriorResponse response = ToProto(posterior, options);
  response.set_sequence(place_.sequence);
  return response;
}

absl::StatusOr<v1::ProfileCostResponse> LoadedSession::CurrentProfiles(
    const v1::ProfileCostRequest& request, const Stop& stop) {
  const ProfileOptions options = ToProfileOptions(request);
  POLYEST_RETURN_IF_ERROR(options.Validate(estimator_->problem().prior()));
  POLYEST_RETURN_IF_ERROR(Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const CostProfiles profiles, estimator_->CurrentProfiles(options, stop));
  v1::ProfileCostResponse response = ToProto(profiles);
  response.set_sequence(place_.sequence);
  return response;
}

absl::StatusOr<v1::SweepRegularizationResponse> LoadedSession::CurrentRegularizationSweep(
    const v1::SweepRegularizationRequest& request, const Stop& stop) {
  const RegularizationOptions options = ToRegularizationOptions(request);
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_RETURN_IF_ERROR(Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const RegularizationSweep sweep,
                           estimator_->CurrentRegularizationSweep(options, stop));
  v1::SweepRegularizationResponse response = ToProto(sweep);
  response.set_sequence(place_.sequence);
  return response;
}

}  // namespace polyest
