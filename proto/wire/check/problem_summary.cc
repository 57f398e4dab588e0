#include "proto/wire/check/problem_summary.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>

#include <map>

#include "core/common/status.h"
#include "core/estimator/expansion/expansion_design.h"
#include "proto/wire/check/numbers.h"

namespace polyest::internal {
namespace {

std::string WithUnit(const std::string& text, const std::string& unit) {
  return unit.empty() || unit == "1" ? text : absl::StrCat(text, " ", unit);
}
std::string WithUnit(double value, const std::string& unit) {
  return WithUnit(Number(value), unit);
}

std::string Interval(double lower, double upper) {
  return absl::StrCat("[", Number(lower), ", ", Number(upper), "]");
}

std::string DescribeInterpolation(bool hold, v1::Input::Interpolation interpolation,
                                  const char* preset) {
  if (hold) return "held";
  if (interpolation == v1::Input::INTERPOLATION_UNSPECIFIED) return preset;
  return absl::StrReplaceAll(absl::AsciiStrToLower(v1::Input::Interpolation_Name(interpolation)),
                             {{"_", "-"}});
}

std::string DescribeTable(const v1::Input::Table& table) {
  return absl::StrFormat("table of %d knots, %s", table.time_s_size(),
                         DescribeInterpolation(table.hold(), table.interpolation(), "linear"));
}

std::string DescribeInput(const v1::Problem& problem, const Quantity& input) {
  for (const v1::Input& given : problem.inputs()) {
    if (given.name() == input.name) return DescribeSignal(given, input.unit);
  }
  return "not given; taken as 0";
}

void Add(const char* topic, const std::string& name, const std::string& description,
         Remarks& remarks) {
  v1::CheckProblemResponse::Remark& remark = remarks.emplace_back();
  remark.set_topic(topic);
  remark.set_name(name);
  remark.set_description(description);
}

}  // namespace

std::string DescribePrior(const v1::UncertainParameter& parameter, const std::string& unit) {
  const auto normal = [&unit](const char* family, const auto& prior) {
    return absl::StrCat(family, " with mean ", WithUnit(prior.mean(), unit),
                        " and standard deviation ", WithUnit(prior.std_dev(), unit));
  };
  switch (parameter.prior_case()) {
    case v1::UncertainParameter::kUniform: {
      const auto& prior = parameter.uniform();
      return WithUnit("uniform on " + Interval(prior.lower(), prior.upper()), unit);
    }
    case v1::UncertainParameter::kNormal:
      return normal("normal", parameter.normal());
    case v1::UncertainParameter::kBeta: {
      const auto& prior = parameter.beta();
      return WithUnit(absl::StrCat("beta(", Number(prior.alpha()), ", ", Number(prior.beta()),
                                   ") on ", Interval(prior.lower(), prior.upper())),
                      unit);
    }
    case v1::UncertainParameter::kGamma: {
      const auto& prior = parameter.gamma();
      return absl::StrCat("gamma of shape ", Number(prior.shape()), ", scale ",
                          WithUnit(prior.scale(), unit), ", from ", WithUnit(prior.shift(), unit));
    }
    case v1::UncertainParameter::kLognormal:
      return normal("lognormal", parameter.lognormal());
    case v1::UncertainParameter::kTruncatedNormal: {
      const auto& prior = parameter.truncated_normal();
      return WithUnit(absl::StrCat(normal("normal", prior), ", cut to [",
                                   prior.has_lower() ? Number(prior.lower()) : "-∞", ", ",
                                   prior.has_upper() ? Number(prior.upper()) : "∞", "]"),
                      unit);
    }
    case v1::UncertainParameter::PRIOR_NOT_SET:
      break;
  }
  return "no prior";
}

std::string DescribeNoise(const v1::MeasuredOutput::Noise& noise, const std::string& unit) {
  std::vector<std::string> parts;
  if (noise.absolute() > 0) parts.push_back(WithUnit(noise.absolute(), unit));
  if (noise.relative() > 0) {
    parts.push_back(absl::StrCat(Number(100 * noise.relative()), " % of the value"));
  }
  if (noise.relative_to_max() > 0) {
    parts.push_back(absl::StrCat(
        Number(100 * noise.relative_to_max()), " % of ",
        noise.full_scale() > 0 ? WithUnit(noise.full_scale(), unit) : std::string("the largest")));
  }
  std::string text = absl::StrJoin(parts, " + ");
  if (noise.unknown()) text = parts.empty() ? "of unknown size" : "unknown times " + text;
  if (noise.correlation().has_time_constant_s()) {
    absl::StrAppend(&text, ", correlated over ",
                    WithUnit(noise.correlation().time_constant_s(), "s"));
    if (noise.correlation().white_share() > 0) {
      absl::StrAppend(&text, " but for ", Number(100 * noise.correlation().white_share()),
                      " % of its variance");
    }
  } else if (noise.correlation().auto_()) {
    absl::StrAppend(&text, ", perhaps correlated");
  }
  if (noise.outliers() == v1::MeasuredOutput::Noise::STUDENT_T) text += ", outliers by Student's t";
  if (noise.outliers() == v1::MeasuredOutput::Noise::HUBER) text += ", outliers by Huber";
  return text;
}

std::string DescribeSignal(const v1::Input& input, const std::string& unit) {
  switch (input.signal_case()) {
    case v1::Input::kConstant:
      return absl::StrCat("constant ", WithUnit(input.constant().amplitude(), unit));
    case v1::Input::kStep:
      return absl::StrCat("step of ", WithUnit(input.step().amplitude(), unit), " at ",
                          Number(input.step().time_s()), " s");
    case v1::Input::kSinusoid:
      return absl::StrCat("sinusoid of ", WithUnit(input.sinusoid().amplitude(), unit), " at ",
                          Number(input.sinusoid().frequency_hz()), " Hz");
    case v1::Input::kChirp: {
      const auto& chirp = input.chirp();
      return absl::StrCat("chirp of ", WithUnit(chirp.amplitude(), unit), " from ",
                          Number(chirp.start_frequency_hz()), " to ",
                          Number(chirp.end_frequency_hz()), " Hz at ", Number(chirp.start_s()),
                          " to ", Number(chirp.start_s() + chirp.duration_s()), " s");
    }
    case v1::Input::kHalfSineBump: {
      const auto& bump = input.half_sine_bump();
      return absl::StrCat("half-sine bump of ", WithUnit(bump.amplitude(), unit), " at ",
                          Number(bump.start_s()), " to ",
                          Number(bump.start_s() + bump.duration_s()), " s");
    }
    case v1::Input::kTable:
      return DescribeTable(input.table());
    case v1::Input::kStreamed:
      return absl::StrCat("streamed, ",
                          DescribeInterpolation(input.streamed().hold(),
                                                input.streamed().interpolation(), "cubic"));
    case v1::Input::SIGNAL_NOT_SET:
      break;
  }
  return "no signal";
}

namespace {

// Describes the size of process noise or of a drift.
template <class Noise>
std::string DescribeSize(double value, const Noise& noise) {
  if (!noise.unknown()) return Number(value);
  return absl::StrCat("unknown, from ", Number(noise.lower()), " to ", Number(noise.upper()));
}

void AddUnknowns(const v1::Problem& problem, const ResolvedProblem& resolved, Remarks& remarks) {
  for (int i = 0; i < problem.uncertain_size(); ++i) {
    const auto& parameter = problem.uncertain(i);
    Add("unknowns", parameter.name(),
        absl::StrCat(DescribePrior(parameter, resolved.units()[static_cast<size_t>(i)]),
                     parameter.per_run() ? ", each run its own" : "",
                     parameter.population() ? ", of one population" : ""),
        remarks);
  }
  for (const v1::UncertainParameter& parameter : problem.uncertain()) {
    if (!parameter.has_drift()) continue;
    const auto& walk = parameter.drift().random_walk();
    Add("drift", parameter.name(), DescribeSize(walk.std_dev_per_sqrt_s(), walk), remarks);
  }
  for (const v1::ProcessNoise& noise : problem.process_noise()) {
    Add("process noise", noise.state(), DescribeSize(noise.spectral_density(), noise), remarks);
  }
  for (const v1::Correlation& pair : problem.correlations()) {
    Add("correlations", absl::StrCat(pair.first(), ", ", pair.second()), Number(pair.coefficient()),
        remarks);
  }
  for (const auto& [name, text] :
       std::map<std::string, std::string>(problem.derived().begin(), problem.derived().end())) {
    Add("derived", name, text, remarks);
  }
}

void AddSignals(const v1::Problem& problem, const ResolvedProblem& resolved, Remarks& remarks) {
  const ModelDescription& model = resolved.problem().model->description();
  for (const Quantity& input : model.inputs) {
    Add("inputs", input.name, DescribeInput(problem, input), remarks);
  }
  for (int i = 0; i < problem.measured_size(); ++i) {
    const auto& measured = problem.measured(i);
    const auto column = static_cast<size_t>(resolved.outputs()[static_cast<size_t>(i)]);
    Add("measured", measured.output(),
        "noise " + DescribeNoise(measured.noise(), model.outputs[column].unit), remarks);
  }
  if (!problem.use_when().empty()) Add("useWhen", "", problem.use_when(), remarks);
}

}  // namespace

absl::StatusOr<Remarks> SummarizeProblem(const v1::Problem& problem,
                                         const ResolvedProblem& resolved) {
  POLYEST_ASSIGN_OR_RETURN(const ExpansionDesign design, DesignForPrior(resolved));
  const ModelDescription& model = resolved.problem().model->description();
  Remarks remarks;
  Add("model", model.name, model.summary, remarks);
  AddUnknowns(problem, resolved, remarks);
  AddSignals(problem, resolved, remarks);
  const ExpansionOptions& expansion = resolved.problem().expansion;
  const bool may_rise = expansion.adaptive && !expansion.order;
  Add("expansion", absl::StrCat("order ", design.basis->order(), may_rise ? " at first" : ""),
      absl::StrFormat("%d terms, %d collocation points, %s", design.basis->size(),
                      design.points.rows(), expansion.adaptive ? "adaptive" : "fixed"),
      remarks);
  return remarks;
}

}  // namespace polyest::internal
