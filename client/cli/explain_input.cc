#include "client/cli/explain_input.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>

#include "client/cli/problem_input.h"
#include "core/common/status.h"
#include "polyest/client.h"

namespace polyest::internal {
namespace {

bool StreamsInput(const v1::Problem& problem) {
  return std::any_of(problem.inputs().begin(), problem.inputs().end(),
                     [](const v1::Input& input) { return input.has_streamed(); });
}

v1::Measurements::Channel& ChannelOf(v1::Measurements& measurements, const std::string& name) {
  for (v1::Measurements::Channel& channel : *measurements.mutable_channels()) {
    if (channel.name() == name) return channel;
  }
  v1::Measurements::Channel& added = *measurements.add_channels();
  added.set_name(name);
  return added;
}

// Appends the rows of a batch that belong to run 0. Returns false if the batch has rows of a later
// run. Batches may name their channels in any order, but each has all streamed inputs.
bool AppendFirstRun(const v1::Problem& problem, const v1::Measurements& batch,
                    v1::Measurements& measurements) {
  int rows = 0;
  while (rows < batch.time_s_size() && (batch.run().empty() || batch.run(rows) == 0)) ++rows;
  measurements.mutable_time_s()->Add(batch.time_s().begin(), batch.time_s().begin() + rows);
  for (const v1::Input& input : problem.inputs()) {
    if (!input.has_streamed()) continue;
    for (const v1::Measurements::Channel& channel : batch.channels()) {
      if (channel.name() != input.name()) continue;
      ChannelOf(measurements, input.name())
          .mutable_values()
          ->Add(channel.values().begin(), channel.values().begin() + rows);
    }
  }
  return rows == batch.time_s_size();
}

absl::StatusOr<v1::Measurements> FirstRunOf(Client& client, const v1::Session& session) {
  v1::Measurements measurements;
  bool ended = false;
  v1::ExportSessionRequest request;
  request.set_name(session.name());
  const absl::Status exported =
      client.ExportSession(request, [&](const v1::SessionRecord& record) -> absl::Status {
        if (!record.has_batch()) return absl::OkStatus();
        ended = !AppendFirstRun(session.problem(), record.batch().measurements(), measurements);
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
    POLYEST_ASSIGN_OR_RETURN(input.measurements, FirstRunOf(client, session));
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
