#include "client/cli/explain_input.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>

#include "client/cli/data_input.h"
#include "client/cli/problem_input.h"
#include "client/cli/remedy_trial.h"
#include "core/common/status.h"
#include "core/model/unit_conversion.h"
#include "polyest/client.h"
#include "polyest/data_file.h"
#include "proto/wire/convert/measurements.h"

namespace polyest::internal {
namespace {

bool StreamsInput(const v1::Problem& problem) {
  return std::any_of(problem.inputs().begin(), problem.inputs().end(),
                     [](const v1::Input& input) { return input.has_streamed(); });
}

bool IsStreamedInput(const v1::Problem& problem, const std::string& name) {
  return std::any_of(problem.inputs().begin(), problem.inputs().end(), [&](const v1::Input& input) {
    return input.has_streamed() && input.name() == name;
  });
}

// Converts a channel's values to the model's unit.
absl::Status ToModelUnit(const DataColumns& columns, v1::Measurements::Channel& channel) {
  const auto unit = columns.units.find(channel.name());
  if (channel.unit().empty() || unit == columns.units.end()) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(const UnitConversion conversion,
                           ConvertUnit(channel.unit(), unit->second));
  std::transform(channel.values().begin(), channel.values().end(),
                 channel.mutable_values()->begin(), conversion);
  channel.clear_unit();
  return absl::OkStatus();
}

// Returns the streamed inputs in the rows of the first run of a batch.
v1::Measurements FirstRunOf(const v1::Problem& problem, const v1::Measurements& batch) {
  int rows = 0;
  while (rows < batch.time_s_size() && (batch.run().empty() || batch.run(rows) == 0)) ++rows;
  v1::Measurements inputs;
  inputs.mutable_time_s()->Add(batch.time_s().begin(), batch.time_s().begin() + rows);
  for (const v1::Measurements::Channel& channel : batch.channels()) {
    if (!IsStreamedInput(problem, channel.name())) continue;
    v1::Measurements::Channel& added = *inputs.add_channels();
    added.set_name(channel.name());
    added.set_unit(channel.unit());
    added.mutable_values()->Add(channel.values().begin(), channel.values().begin() + rows);
    for (const int row : channel.missing()) {
      if (row < rows) added.add_missing(row);
    }
  }
  return inputs;
}

// Returns the record of a session in the model's units: all of it, or the streamed inputs of its
// first run.
absl::StatusOr<v1::Measurements> RecordOf(Client& client, const v1::Session& session,
                                          const Place& place, bool all) {
  POLYEST_ASSIGN_OR_RETURN(const DataColumns columns, DataColumnsFor(session.problem(), place, {}));
  v1::Measurements record;
  bool ended = false;
  v1::ExportSessionRequest request;
  request.set_name(session.name());
  const absl::Status exported =
      client.ExportSession(request, [&](const v1::SessionRecord& piece) -> absl::Status {
        if (!piece.has_batch()) return absl::OkStatus();
        const v1::Measurements& batch = piece.batch().measurements();
        v1::Measurements rows = all ? batch : FirstRunOf(session.problem(), batch);
        for (v1::Measurements::Channel& channel : *rows.mutable_channels()) {
          POLYEST_RETURN_IF_ERROR(ToModelUnit(columns, channel));
        }
        AppendRows(rows, record);
        ended = rows.time_s_size() < batch.time_s_size();
        return ended ? absl::CancelledError("the first run is complete") : absl::OkStatus();
      });
  if (!exported.ok() && !ended) return exported;
  if (session.reorder_window_s() > 0) PutInTimeOrder(record);
  return record;
}

// Lets the estimate of a session be that of its record in one call, which tests what the problem
// holds fixed. Where that cannot be computed, it stays as it is.
void EstimateAtOnce(Backend& backend, ExplainInput& input) {
  v1::ComputeEstimateRequest request;
  v1::Experiment& experiment = *request.mutable_subject()->mutable_experiment();
  *experiment.mutable_problem() = input.problem;
  *experiment.mutable_measurements() = input.measurements;
  auto response = backend.ComputeEstimate(request);
  if (response.ok()) input.estimate = std::move(*response->mutable_estimate());
}

absl::StatusOr<ExplainInput> ReadSession(const ExplainArguments& arguments, Backend& backend) {
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  ExplainInput input;
  v1::GetSessionRequest get;
  get.set_name(absl::StrCat("sessions/", arguments.session));
  POLYEST_ASSIGN_OR_RETURN(const v1::Session session, client.GetSession(get));
  input.problem = session.problem();
  v1::GetEstimateRequest request;
  request.set_session(session.name());
  POLYEST_ASSIGN_OR_RETURN(input.estimate, client.GetEstimate(request));
  const int64_t channels = std::max(1, session.problem().measured_size());
  input.rows = static_cast<int>(
      std::min<int64_t>(session.sample_count() / channels, std::numeric_limits<int>::max()));
  const bool all = !arguments.no_remedies && CallsForRemedies(input.problem, input.estimate);
  if (all || StreamsInput(session.problem())) {
    POLYEST_ASSIGN_OR_RETURN(input.measurements, RecordOf(client, session, arguments.place, all));
  }
  if (all) EstimateAtOnce(backend, input);
  return input;
}

}  // namespace

absl::StatusOr<ExplainInput> ReadExplainInput(const ExplainArguments& arguments, Backend& backend) {
  if (!arguments.session.empty()) return ReadSession(arguments, backend);
  v1::ComputeEstimateRequest request;
  v1::Experiment& experiment = *request.mutable_subject()->mutable_experiment();
  ExplainInput input;
  DataWarnings warnings;
  POLYEST_ASSIGN_OR_RETURN(input.files, ReadProblemAndData(arguments, experiment, warnings));
  auto response = backend.ComputeEstimate(request);
  if (!response.ok()) return InFiles(response.status(), input.files);
  input.problem = std::move(*experiment.mutable_problem());
  input.estimate = std::move(*response->mutable_estimate());
  input.measurements = std::move(*experiment.mutable_measurements());
  input.rows = input.measurements.time_s_size();
  return input;
}

}  // namespace polyest::internal
