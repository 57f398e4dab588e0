#include "server/convert/studies.h"

#include <absl/strings/str_format.h>

#include "server/convert/estimate.h"

namespace polyest {
namespace {

using Doubles = google::protobuf::RepeatedField<double>;

void Append(const Vector& values, Doubles& added) {
  added.Add(values.data(), values.data() + values.size());
}

// Row-major, whatever the matrix is.
void Append(const Matrix& values, Doubles& added) {
  added.Reserve(static_cast<int>(values.size()));
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    for (Eigen::Index column = 0; column < values.cols(); ++column) {
      added.Add(values(row, column));
    }
  }
}

void ToProto(const PropagatedOutput& output, v1::PropagateResponse::Output& proto) {
  proto.set_name(output.output);
  proto.set_unit(output.unit);
  Append(output.mean, *proto.mutable_mean());
  Append(output.standard_deviation, *proto.mutable_std_dev());
  Append(output.quantiles, *proto.mutable_quantiles());
  Append(output.residual, *proto.mutable_residual());
  for (const DensityEstimate& density : output.densities) {
    v1::PropagateResponse::Density& added = *proto.add_densities();
    Append(density.value, *added.mutable_value());
    Append(density.density, *added.mutable_density());
  }
}

Diagnostic PointsFailed(const Propagation& propagation) {
  const PointFailure& first = propagation.failures.front();
  return {
      DiagnosticCode::kPointsFailed,
      absl::StrFormat("%d of %d trajectories could not be integrated and were left out; the "
                      "first of them failed after %g s: %s",
                      propagation.failures.size(), propagation.points, first.time_s, first.reason)};
}

const std::string& UnitOf(const std::string& parameter, const ResolvedProblem& problem) {
  const auto& parameters = problem.prior().parameters();
  size_t index = 0;
  while (parameters.at(index).name != parameter) ++index;
  return problem.units()[index];
}

}  // namespace

PropagationOptions ToPropagationOptions(const v1::PropagateRequest& request) {
  PropagationOptions options;
  options.until_s = request.until();
  options.step_s = request.step();
  options.outputs.assign(request.outputs().begin(), request.outputs().end());
  if (!request.probabilities().empty()) {
    options.probabilities.assign(request.probabilities().begin(), request.probabilities().end());
  }
  options.density_bins = request.density_bins();
  return options;
}

v1::PropagateResponse ToProto(const Propagation& propagation,
                              const std::vector<double>& probabilities) {
  v1::PropagateResponse response;
  response.mutable_time()->Add(propagation.time_s.begin(), propagation.time_s.end());
  for (const PropagatedOutput& output : propagation.outputs) {
    ToProto(output, *response.add_outputs());
  }
  response.mutable_probabilities()->Add(probabilities.begin(), probabilities.end());
  response.set_order(propagation.order);
  response.set_terms(propagation.terms);
  response.set_points(propagation.points);
  if (!propagation.failures.empty()) {
    *response.add_diagnostics() = ToProto(PointsFailed(propagation));
  }
  return response;
}

CostGridOptions ToCostGridOptions(const v1::EvaluateCostRequest& request) {
  CostGridOptions options;
  options.parameters.assign(request.parameters().begin(), request.parameters().end());
  options.points = request.grid_points();
  options.held = {request.held().begin(), request.held().end()};
  return options;
}

v1::EvaluateCostResponse ToProto(const CostGrid& grid, const ResolvedProblem& problem) {
  v1::EvaluateCostResponse response;
  for (size_t i = 0; i < grid.parameters.size(); ++i) {
    v1::EvaluateCostResponse::Axis& axis = *response.add_axes();
    axis.set_parameter(grid.parameters[i]);
    axis.set_unit(UnitOf(grid.parameters[i], problem));
    Append(grid.axes[i], *axis.mutable_value());
  }
  Append(grid.mismatch, *response.mutable_mismatch());
  Append(grid.prior, *response.mutable_prior());
  Append(grid.total, *response.mutable_total());
  return response;
}

}  // namespace polyest
