#include "client/cli/model_comparison.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/cli/first_rows.h"
#include "core/common/status.h"
#include "proto/wire/convert/problem.h"

namespace polyest::internal {
namespace {

bool MakesNumbersDoubtful(v1::Diagnostic::Code code) {
  return code == v1::Diagnostic::EXPANSION_INACCURATE || code == v1::Diagnostic::NOT_CONVERGED ||
         code == v1::Diagnostic::POINTS_FAILED;
}

}  // namespace

absl::StatusOr<Assessment> Weigh(const v1::Experiment& experiment, Backend& backend) {
  v1::ComputePosteriorRequest request;
  *request.mutable_subject()->mutable_experiment() = experiment;
  Assessment assessment;
  POLYEST_ASSIGN_OR_RETURN(assessment.posterior, backend.ComputePosterior(request));
  assessment.values = assessment.posterior.measured_value_count();
  if (assessment.posterior.has_log_evidence()) {
    assessment.log_evidence = assessment.posterior.log_evidence();
  }
  for (const v1::MeasuredOutput& output : experiment.problem().measured()) {
    if (output.noise().unknown()) assessment.unknown_noise.insert(output.output());
  }
  return assessment;
}

absl::Status Score(const v1::Experiment& whole, const HoldOut& hold_out, Backend& backend,
                   Assessment& assessment) {
  const int rows = whole.measurements().time_s_size();
  const int64_t first = std::llround((1 - hold_out.fraction) * rows);
  if (first < 1 || first == rows) {
    return absl::InvalidArgumentError(absl::StrFormat("--hold-out: %g of %d rows leaves none to %s",
                                                      hold_out.fraction, rows,
                                                      first < 1 ? "estimate from" : "predict"));
  }
  v1::PredictRequest request;
  v1::Experiment& seen = *request.mutable_subject()->mutable_experiment();
  *seen.mutable_problem() = whole.problem();
  *seen.mutable_measurements() = FirstRows(whole.measurements(), first);
  *request.mutable_record() = whole.measurements();
  request.set_same_runs(true);
  request.set_first_scored_row(first);
  if (UsesFilters(whole.problem())) request.set_horizon_s(hold_out.horizon_s);
  POLYEST_ASSIGN_OR_RETURN(const v1::PredictResponse prediction, backend.Predict(request));
  for (const v1::Diagnostic& diagnostic : prediction.diagnostics()) {
    if (MakesNumbersDoubtful(diagnostic.code())) assessment.doubts.push_back(diagnostic.code());
  }
  for (const v1::PredictResponse::Output& output : prediction.outputs()) {
    const auto samples = static_cast<double>(output.score().sample_count());
    assessment.held_out += output.score().sample_count();
    assessment.log_score += samples * output.score().log_score();
    assessment.covered += samples * output.score().coverage95();
  }
  return absl::OkStatus();
}

bool HaveComparableEvidence(const Assessment& one, const Assessment& other) {
  return one.log_evidence && other.log_evidence && one.unknown_noise == other.unknown_noise;
}

double Coverage(const Assessment& assessment) {
  return assessment.covered / static_cast<double>(std::max<int64_t>(1, assessment.held_out));
}

}  // namespace polyest::internal
