#include "proto/wire/convert/log_density.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include "proto/wire/convert/annotate.h"
#include "proto/wire/convert/estimate.h"
#include "proto/wire/convert/repeated.h"

namespace polyest::internal {
namespace {

void AppendFunction(const std::vector<LogDensityValue>& points,
                    v1::ComputeLogDensityResponse::Function& function) {
  for (const LogDensityValue& point : points) {
    function.add_value(point.value);
    Append(point.gradient, *function.mutable_gradient());
    Append(point.hessian, *function.mutable_hessian());
  }
}

}  // namespace

absl::StatusOr<LogDensityOptions> ToLogDensityOptions(const v1::ComputeLogDensityRequest& request,
                                                      const std::vector<std::string>& parameters) {
  const auto columns = static_cast<int>(parameters.size());
  if (request.values_size() % columns != 0) {
    return InvalidField(
        "values", absl::StrFormat("%d values are no points of %d each, one for each of %s",
                                  request.values_size(), columns, absl::StrJoin(parameters, ", ")));
  }
  LogDensityOptions options;
  options.derivative_order = request.derivative_order();
  options.points.resize(request.values_size() / columns, columns);
  for (int i = 0; i < request.values_size(); ++i) {
    options.points(i / columns, i % columns) = request.values(i);
  }
  return options;
}

v1::ComputeLogDensityResponse ToProto(const LogDensity& density) {
  v1::ComputeLogDensityResponse response;
  response.mutable_parameters()->Add(density.parameters.begin(), density.parameters.end());
  response.mutable_units()->Add(density.units.begin(), density.units.end());
  AppendFunction(density.posterior, *response.mutable_log_posterior());
  AppendFunction(density.likelihood, *response.mutable_log_likelihood());
  for (const Diagnostic& diagnostic : density.diagnostics) {
    *response.add_diagnostics() = ToProto(diagnostic);
  }
  return response;
}

}  // namespace polyest::internal
