#include "proto/wire/convert/prediction.h"

#include <algorithm>
#include <cmath>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/studies/prediction.h"
#include "proto/wire/convert/estimate.h"
#include "proto/wire/convert/measurements.h"
#include "proto/wire/convert/repeated.h"

namespace polyest::internal {
namespace {

using Output = v1::PredictResponse::Output;

// Adds the samples, which only some of the times have.
void AddSamples(const PredictedOutput& output, Output& proto) {
  const bool standardized = output.standardized_residual.size() > 0;
  for (Eigen::Index k = 0; k < output.measured.size(); ++k) {
    if (std::isnan(output.measured[k])) continue;
    proto.add_measured_rows(static_cast<int32_t>(k));
    proto.add_measured(output.measured[k]);
    proto.add_residual(output.residual[k]);
    if (standardized) proto.add_standardized_residual(output.standardized_residual[k]);
  }
}

void ToProto(const PredictedOutput& output, Output& proto) {
  proto.set_output(output.output);
  proto.set_unit(output.unit);
  Append(output.mean, *proto.mutable_mean());
  Append(output.std_dev, *proto.mutable_std_dev());
  Append(output.quantiles, *proto.mutable_quantiles());
  AddSamples(output, proto);
  if (output.abrupt_change) {
    v1::PredictResponse::AbruptChange& change = *proto.mutable_abrupt_change();
    change.set_run(output.abrupt_change->at.run);
    change.set_time_s(output.abrupt_change->at.time_s);
    change.set_score(output.abrupt_change->score);
    change.set_limit(output.abrupt_change->limit);
  }
  if (output.sample_std_dev.size() == 0) return;
  Append(output.sample_std_dev, *proto.mutable_sample_std_dev());
  Append(output.sample_quantiles, *proto.mutable_sample_quantiles());
  v1::PredictResponse::Score& score = *proto.mutable_score();
  score.set_sample_count(output.score.samples);
  score.set_log_score(output.score.log_score);
  score.set_coverage95(output.score.coverage95);
  score.set_root_mean_square(output.score.root_mean_square);
  Append(output.score.autocorrelation, *score.mutable_autocorrelation());
}

}  // namespace

absl::StatusOr<PredictionOptions> ToPredictionOptions(const v1::PredictRequest& request,
                                                      const Model& model) {
  PredictionOptions options;
  options.outputs.assign(request.outputs().begin(), request.outputs().end());
  if (!request.probabilities().empty()) {
    options.probabilities.assign(request.probabilities().begin(), request.probabilities().end());
  }
  if (request.draw_count() != 0) options.draws = request.draw_count();
  if (request.max_row_count() != 0) options.max_rows = request.max_row_count();
  for (const v1::RecordTime& time : request.times()) {
    options.times.push_back({time.run(), time.time_s()});
  }
  options.horizon_s = request.horizon_s();
  options.smoothed = request.smoothed();
  options.forecast_s = request.forecast_s();
  if (request.lag_count() != 0) options.lags = request.lag_count();
  options.first_scored_row = request.first_scored_row();
  options.same_runs = request.same_runs();
  if (request.has_record()) {
    absl::StatusOr<Samples> record = ToSamples(request.record(), model);
    if (!record.ok()) return OfRecord(record.status());
    options.record = *std::move(record);
    options.record->end_of_run = true;
  }
  return options;
}

v1::PredictResponse ToProto(const Prediction& prediction, const PredictionOptions& options) {
  v1::PredictResponse response;
  const bool several = std::any_of(prediction.rows.begin(), prediction.rows.end(),
                                   [](const SampleRow& row) { return row.run != 0; });
  for (const SampleRow& row : prediction.rows) {
    if (several) response.add_run(row.run);
    response.add_time_s(row.time_s);
  }
  response.mutable_probabilities()->Add(options.probabilities.begin(), options.probabilities.end());
  for (const PredictedOutput& output : prediction.outputs) {
    ToProto(output, *response.add_outputs());
  }
  response.set_draw_count(prediction.draws);
  response.set_failed_draw_count(prediction.failed);
  response.set_row_count(prediction.record_rows);
  for (const Diagnostic& diagnostic : prediction.diagnostics) {
    *response.add_diagnostics() = ToProto(diagnostic);
  }
  return response;
}

}  // namespace polyest::internal
