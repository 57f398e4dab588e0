#include "proto/wire/convert/studies.h"

#include "proto/wire/convert/estimate.h"
#include "proto/wire/convert/expansion_used.h"
#include "proto/wire/convert/repeated.h"

namespace polyest::internal {
namespace {

void ToProto(const PropagatedOutput& output, v1::ComputePropagationResponse::Output& proto) {
  proto.set_name(output.output);
  proto.set_unit(output.unit);
  Append(output.mean, *proto.mutable_mean());
  Append(output.std_dev, *proto.mutable_std_dev());
  Append(output.quantiles, *proto.mutable_quantiles());
  Append(output.residual, *proto.mutable_residual());
  proto.mutable_from_draws()->Add(output.from_draws.begin(), output.from_draws.end());
  for (const DensityEstimate& density : output.densities) {
    v1::ComputePropagationResponse::Density& added = *proto.add_densities();
    Append(density.value, *added.mutable_value());
    Append(density.density, *added.mutable_density());
  }
}

void ToProto(const OutputSensitivity& output, v1::ComputeSensitivityResponse::Output& proto) {
  proto.set_name(output.output);
  proto.set_unit(output.unit);
  Append(output.mean, *proto.mutable_mean());
  Append(output.std_dev, *proto.mutable_std_dev());
  Append(output.first_order, *proto.mutable_first_order());
  Append(output.total, *proto.mutable_total());
  Append(output.residual, *proto.mutable_residual());
  Append(output.noise, *proto.mutable_noise_std_dev());
}

}  // namespace

PropagationOptions ToPropagationOptions(const v1::ComputePropagationRequest& request) {
  PropagationOptions options;
  options.until_s = request.until_s();
  options.step_s = request.step_s();
  options.outputs.assign(request.outputs().begin(), request.outputs().end());
  if (!request.probabilities().empty()) {
    options.probabilities.assign(request.probabilities().begin(), request.probabilities().end());
  }
  options.density_bins = request.density_bin_count();
  if (request.draw_count() != 0) options.draws = request.draw_count();
  return options;
}

v1::ComputePropagationResponse ToProto(const Propagation& propagation,
                                       const std::vector<double>& probabilities) {
  v1::ComputePropagationResponse response;
  response.mutable_time_s()->Add(propagation.time_s.begin(), propagation.time_s.end());
  for (const PropagatedOutput& output : propagation.outputs) {
    ToProto(output, *response.add_outputs());
  }
  response.mutable_probabilities()->Add(probabilities.begin(), probabilities.end());
  *response.mutable_expansion() = ToExpansionUsed(propagation);
  response.set_draw_count(propagation.draws);
  for (const Diagnostic& diagnostic : propagation.diagnostics) {
    *response.add_diagnostics() = ToProto(diagnostic);
  }
  return response;
}

CostGridOptions ToCostGridOptions(const v1::ComputeCostGridRequest& request) {
  CostGridOptions options;
  options.parameters.assign(request.parameters().begin(), request.parameters().end());
  options.points = request.point_count();
  options.held = {request.held().begin(), request.held().end()};
  return options;
}

v1::ComputeCostGridResponse ToProto(const CostGrid& grid) {
  v1::ComputeCostGridResponse response;
  for (size_t i = 0; i < grid.parameters.size(); ++i) {
    v1::ComputeCostGridResponse::Axis& axis = *response.add_axes();
    axis.set_parameter(grid.parameters[i]);
    axis.set_unit(grid.units[i]);
    Append(grid.axes[i], *axis.mutable_value());
  }
  Append(grid.mismatch, *response.mutable_mismatch());
  Append(grid.prior, *response.mutable_prior());
  Append(grid.total, *response.mutable_total());
  return response;
}

SensitivityOptions ToSensitivityOptions(const v1::ComputeSensitivityRequest& request) {
  SensitivityOptions options;
  options.until_s = request.until_s();
  options.step_s = request.step_s() != 0 ? request.step_s() : request.until_s() / 100;
  options.outputs.assign(request.outputs().begin(), request.outputs().end());
  if (request.draw_count() != 0) options.draws = request.draw_count();
  return options;
}

v1::ComputeSensitivityResponse ToProto(const SensitivityAnalysis& analysis) {
  v1::ComputeSensitivityResponse response;
  response.mutable_time_s()->Add(analysis.time_s.begin(), analysis.time_s.end());
  response.mutable_parameters()->Add(analysis.parameters.begin(), analysis.parameters.end());
  for (const OutputSensitivity& output : analysis.outputs) {
    ToProto(output, *response.add_outputs());
  }
  for (const ParameterActivity& activity : analysis.activity) {
    v1::ComputeSensitivityResponse::Activity& added = *response.add_activity();
    added.set_parameter(activity.parameter);
    added.set_share(activity.share);
    added.set_peak_to_noise(activity.peak_to_noise);
  }
  *response.mutable_expansion() = ToExpansionUsed(analysis);
  response.set_draw_count(analysis.draws);
  for (const Diagnostic& diagnostic : analysis.diagnostics) {
    *response.add_diagnostics() = ToProto(diagnostic);
  }
  return response;
}

}  // namespace polyest::internal
