#include "server/convert/experiment_design.h"

#include "server/convert/estimate.h"

namespace polyest {
namespace {

void ToProto(const InformationGain& gain, v1::DesignExperimentResponse::Gain& proto) {
  proto.set_bits(gain.bits);
  proto.mutable_std_dev()->Add(gain.standard_deviation.begin(), gain.standard_deviation.end());
}

void ToProto(const OutputGain& output, v1::DesignExperimentResponse::Output& proto) {
  proto.set_name(output.output);
  proto.set_unit(output.unit);
  proto.set_noise_std_dev(output.noise);
  proto.set_measured(output.measured);
  ToProto(output.alone, *proto.mutable_alone());
  ToProto(output.together, *proto.mutable_together());
}

}  // namespace

ExperimentOptions ToExperimentOptions(const v1::DesignExperimentRequest& request) {
  ExperimentOptions options;
  options.until_s = request.until();
  options.step_s = request.step() != 0 ? request.step() : request.until() / 100;
  if (request.samples() != 0) options.samples = request.samples();
  for (const v1::MeasuredOutput& possible : request.possible()) {
    const auto& noise = possible.noise();
    options.possible.push_back({possible.output(),
                                {.absolute = noise.absolute(),
                                 .relative = noise.relative(),
                                 .relative_to_max = noise.relative_to_max()}});
  }
  return options;
}

v1::DesignExperimentResponse::Candidate ToProto(const ExperimentDesign& design) {
  v1::DesignExperimentResponse::Candidate proto;
  ToProto(design.gain, *proto.mutable_gain());
  for (const OutputGain& output : design.outputs) ToProto(output, *proto.add_outputs());
  for (const SampleTime& sample : design.samples) {
    v1::DesignExperimentResponse::SampleTime& added = *proto.add_samples();
    added.set_time(sample.time_s);
    ToProto(sample.gain, *added.mutable_gain());
  }
  proto.set_order(design.order);
  proto.set_terms(design.terms);
  proto.set_points(design.points);
  for (const Diagnostic& diagnostic : design.diagnostics) {
    *proto.add_diagnostics() = ToProto(diagnostic);
  }
  return proto;
}

void AddParameters(const ResolvedProblem& problem, v1::DesignExperimentResponse& response) {
  const Vector mean = problem.prior().Mean();
  const Vector std_dev = problem.prior().StandardDeviation();
  for (int i = 0; i < problem.dimension(); ++i) {
    const auto index = static_cast<size_t>(i);
    v1::DesignExperimentResponse::Parameter& parameter = *response.add_parameters();
    parameter.set_name(problem.prior().parameters()[index].name);
    parameter.set_unit(problem.units()[index]);
    parameter.set_mean(mean[i]);
    parameter.set_std_dev(std_dev[i]);
  }
}

}  // namespace polyest
