#include "proto/wire/convert/regularization.h"

#include "proto/wire/convert/estimate.h"

namespace polyest::internal {
namespace {

void ToProto(const RegularizationPoint& point,
             v1::ComputeRegularizationSweepResponse::Point& proto) {
  proto.set_regularization(point.regularization);
  proto.mutable_cost()->set_total(point.cost.total);
  proto.mutable_cost()->set_mismatch(point.cost.mismatch);
  proto.mutable_cost()->set_prior(point.cost.prior);
  proto.set_effective_parameters(point.effective_parameters);
  proto.set_log_evidence(point.log_evidence);
  proto.mutable_map()->Add(point.map.begin(), point.map.end());
  proto.mutable_std_dev()->Add(point.std_dev.begin(), point.std_dev.end());
  proto.set_converged(point.converged);
}

void ToProto(const RegularizationChoice& choice,
             v1::ComputeRegularizationSweepResponse::Choice& proto) {
  proto.set_determined(choice.determined);
  proto.set_regularization(choice.regularization);
  proto.set_reason(choice.reason);
}

}  // namespace

RegularizationOptions ToRegularizationOptions(
    const v1::ComputeRegularizationSweepRequest& request) {
  RegularizationOptions options;
  if (request.lowest() != 0) options.lowest = request.lowest();
  if (request.highest() != 0) options.highest = request.highest();
  if (request.point_count() != 0) options.points = request.point_count();
  return options;
}

v1::ComputeRegularizationSweepResponse ToProto(const RegularizationSweep& sweep) {
  v1::ComputeRegularizationSweepResponse response;
  response.mutable_parameters()->Add(sweep.parameters.begin(), sweep.parameters.end());
  response.mutable_units()->Add(sweep.units.begin(), sweep.units.end());
  for (const RegularizationPoint& point : sweep.points) ToProto(point, *response.add_points());
  ToProto(sweep.l_curve, *response.mutable_l_curve());
  ToProto(sweep.discrepancy, *response.mutable_discrepancy());
  ToProto(sweep.evidence, *response.mutable_evidence());
  response.set_regularization(sweep.regularization);
  for (const Diagnostic& diagnostic : sweep.diagnostics) {
    *response.add_diagnostics() = ToProto(diagnostic);
  }
  return response;
}

}  // namespace polyest::internal
