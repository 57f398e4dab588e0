#include "client/cli/explain_input.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>

#include "client/cli/data_input.h"
#include "client/cli/problem_input.h"
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

// Returns the streamed inputs in the first `rows` rows of a batch, in the model's units.
absl::StatusOr<v1::Measurements> InputsOf(const v1::Problem& problem, const DataColumns& columns,
                                          const v1::Measurements& batch, int rows) {
  v1::Measurements inputs;
  inputs.mutable_time_s()->Add(batch.time_s().begin(), batch.time_s().begin() + rows);
  for (const v1::Input& input : problem.inputs()) {
    if (!input.has_streamed()) continue;
    for (const v1::Measurements::Channel& channel : batch.channels()) {
      if (channel.name() != input.name()) continue;
      v1::Measurements::Channel& added = *inputs.add_channels();
      added.set_name(input.name());
      added.mutable_values()->Add(channel.values().begin(), channel.values().begin() + rows);
      for (const int row : channel.missing()) {
        if (row < rows) added.add_missing(row);
      }
      const auto unit = columns.units.find(input.name());
      if (channel.unit().empty() || unit == columns.units.end()) continue;
      POLYEST_ASSIGN_OR_RETURN(const UnitConversion conversion,
                               ConvertUnit(channel.unit(), unit->second));
      std::transform(added.values().begin(), added.values().end(), added.mutable_values()->begin(),
                     conversion);
    }
  }
  return inputs;
}

absl::StatusOr<v1::Measurements> FirstRunOf(Client& client, const v1::Session& session,
                                            const Place& place) {
  POLYEST_ASSIGN_OR_RETURN(const DataColumns columns, DataColumnsFor(session.problem(), place, {}));
  v1::Measurements measurements;
  bool ended = false;
  v1::ExportSessionRequest request;
  request.set_name(session.name());
  const absl::Status exported =
      client.ExportSession(request, [&](const v1::SessionRecord& record) -> absl::Status {
        if (!record.has_batch()) return absl::OkStatus();
        const v1::Measurements& batch = record.batch().measurements();
        int rows = 0;
        while (rows < batch.time_s_size() && (batch.run().empty() || batch.run(rows) == 0)) ++rows;
        POLYEST_ASSIGN_OR_RETURN(const v1::Measurements inputs,
                                 InputsOf(session.problem(), columns, batch, rows));
        AppendRows(inputs, measurements);
        ended = rows < batch.time_s_size();
        return ended ? absl::CancelledError("the first run is complete") : absl::OkStatus();
      });
  if (!exported.ok() && !ended) return exported;
  return measurements;
}

absl::StatusOr<ExplainInput> ReadSession(const ExplainArguments& arguments) {
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
  if (StreamsInput(session.problem())) {
    POLYEST_ASSIGN_OR_RETURN(input.measurements, FirstRunOf(client, session, arguments.place));
  }
  return input;
}

}  // namespace

absl::StatusOr<ExplainInput> ReadExplainInput(const ExplainArguments& arguments, Backend& backend) {
  if (!arguments.session.empty()) return ReadSession(arguments);
  v1::ComputeEstimateRequest request;
  v1::Experiment& experiment = *request.mutable_subject()->mutable_experiment();
  POLYEST_RETURN_IF_ERROR(ReadProblemAndData(
      arguments.problem_file, arguments.data_file, arguments.place, *experiment.mutable_problem(),
      *experiment.mutable_measurements(), arguments.data_options));
  auto response = backend.ComputeEstimate(request);
  if (!response.ok()) return InInput(response.status(), arguments);
  ExplainInput input;
  input.problem = std::move(*experiment.mutable_problem());
  input.estimate = std::move(*response->mutable_estimate());
  input.measurements = std::move(*experiment.mutable_measurements());
  input.rows = input.measurements.time_s_size();
  return input;
}

}  // namespace polyest::internal
