#include "proto/wire/convert/experiment_design.h"

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "proto/wire/convert/estimate.h"
#include "proto/wire/convert/noise.h"

namespace polyest::internal {
namespace {

void ToProto(const InformationGain& gain, v1::ComputeExperimentDesignResponse::Gain& proto) {
  proto.set_bits(gain.bits);
  proto.mutable_std_dev()->Add(gain.std_dev.begin(), gain.std_dev.end());
}

void ToProto(const OutputGain& output, v1::ComputeExperimentDesignResponse::Output& proto) {
  proto.set_name(output.output);
  proto.set_unit(output.unit);
  proto.set_noise_std_dev(output.noise);
  proto.set_measured(output.measured);
  ToProto(output.alone, *proto.mutable_alone());
  ToProto(output.together, *proto.mutable_together());
}

// Converts the noise of an output that could be measured. A design weighs independent samples with
// a noise of known size, whatever they will be.
absl::StatusOr<NoiseModel> ToNoiseOfDesign(const v1::MeasuredOutput::Noise& given) {
  POLYEST_ASSIGN_OR_RETURN(const NoiseModel noise, ToNoise(given));
  if (noise.unknown) {
    return InvalidField("unknown",
                        "is not available for a design; leave the noise out for 1 % of the range "
                        "of the predictions");
  }
  if (noise.correlation != NoiseCorrelation::kWhite) {
    return InvalidField("correlation", "is not available for a design, which takes noise as white");
  }
  if (noise.outliers != OutlierHandling::kNone) {
    return InvalidField("outliers", "are not available for a design, which expects none");
  }
  return noise;
}

}  // namespace

absl::StatusOr<ExperimentOptions> ToExperimentOptions(
    const v1::ComputeExperimentDesignRequest& request) {
  ExperimentOptions options;
  options.until_s = request.until_s();
  options.step_s = request.step_s() != 0 ? request.step_s() : request.until_s() / 100;
  if (request.sample_count() != 0) options.samples = request.sample_count();
  for (int i = 0; i < request.possible_size(); ++i) {
    const v1::MeasuredOutput& possible = request.possible(i);
    POLYEST_ASSIGN_OR_RETURN(const NoiseModel noise,
                             Within({"possible", i, "noise"}, ToNoiseOfDesign(possible.noise())));
    options.possible.push_back({possible.output(), noise});
  }
  return options;
}

v1::ComputeExperimentDesignResponse::Candidate ToProto(const ExperimentDesign& design) {
  v1::ComputeExperimentDesignResponse::Candidate proto;
  ToProto(design.gain, *proto.mutable_gain());
  for (const OutputGain& output : design.outputs) ToProto(output, *proto.add_outputs());
  for (const SampleTime& sample : design.samples) {
    v1::ComputeExperimentDesignResponse::SampleTime& added = *proto.add_samples();
    added.set_time_s(sample.time_s);
    ToProto(sample.gain, *added.mutable_gain());
  }
  proto.set_draw_count(design.draws);
  proto.set_trajectory_count(design.trajectories);
  for (const Diagnostic& diagnostic : design.diagnostics) {
    *proto.add_diagnostics() = ToProto(diagnostic);
  }
  return proto;
}

void AddParameters(const ResolvedProblem& problem, v1::ComputeExperimentDesignResponse& response) {
  const Vector mean = problem.prior().Mean();
  const Vector std_dev = problem.prior().StandardDeviation();
  for (int i = 0; i < problem.dimension(); ++i) {
    const auto index = static_cast<size_t>(i);
    v1::ComputeExperimentDesignResponse::Parameter& parameter = *response.add_parameters();
    parameter.set_name(problem.prior().parameters()[index].name);
    parameter.set_unit(problem.units()[index]);
    parameter.set_mean(mean[i]);
    parameter.set_std_dev(std_dev[i]);
  }
}

}  // namespace polyest::internal
