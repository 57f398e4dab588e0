#include "core/estimator/problem/validate_noise.h"

#include <absl/strings/str_format.h>

#include <cmath>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// The limits between which the squares of outputs, in units of the noise, are finite numbers
// (propagation/output_limit.h).
constexpr double kMinNoise = 1e-50, kMaxNoise = 1e50;

absl::Status ValidateCorrelation(const FieldPath& noise_field, const NoiseModel& noise) {
  const auto field = [&](const char* name) { return noise_field.Then({"correlation", name}); };
  if (!std::isfinite(noise.time_constant_s) || noise.time_constant_s < 0 ||
      (noise.correlation == NoiseCorrelation::kKnown && noise.time_constant_s == 0)) {
    return InvalidField(field("time_constant_s"),
                        absl::StrFormat("%g must be a finite time > 0", noise.time_constant_s));
  }
  if (!(noise.white_share >= 0 && noise.white_share < 1)) {
    return InvalidField(field("white_share"),
                        absl::StrFormat("%g must be at least 0 and below 1", noise.white_share));
  }
  if (noise.white_share > 0 && noise.correlation != NoiseCorrelation::kKnown) {
    return InvalidField(field("white_share"),
                        absl::StrFormat("%g has no effect without timeConstantS, over which the "
                                        "rest of the noise is correlated",
                                        noise.white_share));
  }
  if (noise.time_constant_s > 0 && noise.correlation != NoiseCorrelation::kKnown) {
    return InvalidField(
        field("time_constant_s"),
        absl::StrFormat("%g has no effect unless the correlation is known", noise.time_constant_s));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ValidateNoise(const FieldPath& field, const NoiseModel& noise) {
  for (const auto& [name, value] : {std::pair{"absolute", noise.absolute},
                                    {"relative", noise.relative},
                                    {"relative_to_max", noise.relative_to_max},
                                    {"full_scale", noise.full_scale},
                                    {"least", noise.least}}) {
    if (!std::isfinite(value) || value < 0) {
      return InvalidField(field.Then(name),
                          absl::StrFormat("%g must be a finite number ≥ 0", value));
    }
    if (value == 0 || (value >= kMinNoise && value <= kMaxNoise)) continue;
    return InvalidField(field.Then(name), absl::StrFormat("%g must be 0 or lie between %g and %g",
                                                          value, kMinNoise, kMaxNoise));
  }
  POLYEST_RETURN_IF_ERROR(ValidateCorrelation(field, noise));
  if (noise.full_scale > 0 && noise.relative_to_max == 0) {
    return InvalidField(
        field.Then("full_scale"),
        absl::StrFormat("%g has no effect without relativeToMax, the noise as a fraction of it",
                        noise.full_scale));
  }
  return absl::OkStatus();
}

absl::Status ValidateNoise(int index, const MeasuredOutput& measured) {
  const NoiseModel& noise = measured.noise;
  const FieldPath field{"measured", index, "noise"};
  POLYEST_RETURN_IF_ERROR(ValidateNoise(field, noise));
  if (!noise.unknown && noise.absolute + noise.relative + noise.relative_to_max <= 0) {
    return InvalidField(field,
                        absl::StrFormat("output %s needs a noise: at least one of absolute, "
                                        "relative, relativeToMax must be above 0, or the noise "
                                        "unknown",
                                        measured.output));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
