#include "proto/wire/convert/problem.h"

#include <absl/strings/str_format.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/problem/process_noise.h"
#include "core/model/equations/equation_model.h"
#include "polyest/catalogue.h"
#include "proto/wire/convert/annotate.h"
#include "proto/wire/convert/list_lengths.h"
#include "proto/wire/convert/noise.h"
#include "proto/wire/convert/problem_columns.h"
#include "proto/wire/convert/uncertain_parameter.h"
#include "proto/wire/convert/wire_fields.h"

namespace polyest::internal {
namespace {

EquationSpecification ToEquations(const v1::Equations& given) {
  EquationSpecification equations;
  equations.states = {given.states().begin(), given.states().end()};
  equations.outputs = {given.outputs().begin(), given.outputs().end()};
  equations.intermediates = {given.intermediates().begin(), given.intermediates().end()};
  equations.parameters = {given.parameters().begin(), given.parameters().end()};
  equations.inputs = {given.inputs().begin(), given.inputs().end()};
  equations.units = {given.units().begin(), given.units().end()};
  for (const auto& [name, table] : given.tables()) {
    equations.tables[name] = {.x = {table.x().begin(), table.x().end()},
                              .y = {table.y().begin(), table.y().end()},
                              .value = {table.value().begin(), table.value().end()},
                              .spline = table.spline()};
  }
  return equations;
}

// Errors found in a problem so far.
using Refusals = std::vector<absl::Status>;

// Returns the value. On an error, adds it to the refusals and returns `instead`, which must not
// lead to further errors.
template <typename Value>
Value ValueOr(absl::StatusOr<Value> value, Value instead, Refusals& refusals) {
  if (value.ok()) return *std::move(value);
  refusals.push_back(value.status());
  return instead;
}

std::shared_ptr<const Model> ToEquationModel(const v1::Equations& given, Refusals& refusals) {
  const EquationSpecification equations = ToEquations(given);
  auto model = MakeEquationModel(equations);
  if (model.ok()) return *std::move(model);
  for (absl::Status& refusal : CheckEquations(equations)) refusals.push_back(std::move(refusal));
  return nullptr;
}

// Returns the model of a problem. On an error, adds it to the refusals and returns null.
std::shared_ptr<const Model> ToModel(const v1::Problem& problem, const ModelLibrary& models,
                                     Refusals& refusals) {
  switch (problem.model().source_case()) {
    case v1::Problem::Model::kBuiltin: {
      auto model = FindBuiltinModel(problem.model().builtin());
      if (model.ok()) return *std::move(model);
      // Here a name that does not exist is an invalid field of the request, not a missing resource.
      refusals.push_back(InvalidField("model.builtin", model.status().message()));
      return nullptr;
    }
    case v1::Problem::Model::kEquations:
      return ToEquationModel(problem.model().equations(), refusals);
    case v1::Problem::Model::kFmu: {
      auto model = models.FindFmu(problem.model().fmu());
      if (model.ok()) return *std::move(model);
      refusals.push_back(InvalidField("model.fmu", model.status().message()));
      return nullptr;
    }
    case v1::Problem::Model::kUmbridge: {
      auto model = models.FindUmBridge(problem.model().umbridge());
      if (model.ok()) return *std::move(model);
      refusals.push_back(InvalidField("model.umbridge", model.status().message()));
      return nullptr;
    }
    case v1::Problem::Model::SOURCE_NOT_SET:
      break;
  }
  refusals.push_back(
      InvalidField("model", "a model must be named, as in {\"builtin\": \"duffing\"}"));
  return nullptr;
}

std::vector<UncertainParameter> ToUncertain(const v1::Problem& problem, Refusals& refusals) {
  std::vector<UncertainParameter> uncertain;
  for (int i = 0; i < problem.uncertain_size(); ++i) {
    const FieldPath field{"uncertain", i};
    // An invalid prior is replaced by one on the positive half-line, which suits every quantity.
    uncertain.push_back(ValueOr(Within(field, ToPrior(problem.uncertain(i))),
                                {problem.uncertain(i).name(), Germ::Gamma(1)}, refusals));
    uncertain.back().per_run = problem.uncertain(i).per_run();
    uncertain.back().drift = ValueOr(Within(field, ToDrift(problem.uncertain(i))), {}, refusals);
    uncertain.back().population = problem.uncertain(i).population();
  }
  return uncertain;
}

std::vector<Correlation> ToCorrelations(const v1::Problem& problem) {
  std::vector<Correlation> correlations;
  for (const v1::Correlation& pair : problem.correlations()) {
    correlations.push_back({pair.first(), pair.second(), pair.coefficient()});
  }
  return correlations;
}

// Returns the interpolation of the table or streamed signal at `path`; `preset` if none is given.
// Refuses `hold` together with an interpolation.
absl::StatusOr<Interpolation> ToInterpolation(bool hold, v1::Input::Interpolation given,
                                              Interpolation preset, const FieldPath& path) {
  if (hold && given != v1::Input::INTERPOLATION_UNSPECIFIED) {
    return InvalidField(path, "hold and interpolation exclude each other");
  }
  switch (given) {
    case v1::Input::INTERPOLATION_UNSPECIFIED:
      return hold ? Interpolation::kHold : preset;
    case v1::Input::LINEAR:
      return Interpolation::kLinear;
    case v1::Input::CUBIC:
      return Interpolation::kCubic;
    case v1::Input::SHAPE_PRESERVING:
      return Interpolation::kShapePreserving;
    default:
      return UnknownEnumerator(path.Then("interpolation"), given);
  }
}

absl::StatusOr<InputSpecification> ToTable(const v1::Input::Table& table) {
  POLYEST_ASSIGN_OR_RETURN(
      const Interpolation interpolation,
      ToInterpolation(table.hold(), table.interpolation(), Interpolation::kLinear, "table"));
  return TableInput{.time_s = {table.time_s().begin(), table.time_s().end()},
                    .value = {table.value().begin(), table.value().end()},
                    .interpolation = interpolation,
                    .amplitude = table.has_amplitude() ? table.amplitude() : 1};
}

absl::StatusOr<InputSpecification> ToStreamed(const v1::Input::Streamed& streamed) {
  POLYEST_ASSIGN_OR_RETURN(const Interpolation interpolation,
                           ToInterpolation(streamed.hold(), streamed.interpolation(),
                                           Interpolation::kCubic, "streamed"));
  return StreamedInput{interpolation, streamed.has_amplitude() ? streamed.amplitude() : 1};
}

ChirpInput ToChirp(const v1::Input::Chirp& chirp) {
  return {.amplitude = chirp.amplitude(),
          .start_frequency_hz = chirp.start_frequency_hz(),
          .end_frequency_hz = chirp.end_frequency_hz(),
          .start_s = chirp.start_s(),
          .duration_s = chirp.duration_s(),
          .phase_rad = chirp.phase_rad()};
}

absl::StatusOr<InputSpecification> ToSignal(const v1::Input& input) {
  switch (input.signal_case()) {
    case v1::Input::kConstant:
      return ConstantInput{input.constant().amplitude()};
    case v1::Input::kStep:
      return StepInput{input.step().amplitude(), input.step().time_s()};
    case v1::Input::kSinusoid: {
      const auto& sinusoid = input.sinusoid();
      return SinusoidInput{sinusoid.amplitude(), sinusoid.frequency_hz(), sinusoid.phase_rad()};
    }
    case v1::Input::kChirp:
      return ToChirp(input.chirp());
    case v1::Input::kHalfSineBump: {
      const auto& bump = input.half_sine_bump();
      return HalfSineBumpInput{bump.amplitude(), bump.start_s(), bump.duration_s()};
    }
    case v1::Input::kTable:
      return ToTable(input.table());
    case v1::Input::kStreamed:
      return ToStreamed(input.streamed());
    case v1::Input::SIGNAL_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError(absl::StrFormat(
      "%s needs a signal: constant, step, sinusoid, chirp, halfSineBump, table or streamed",
      input.name().empty() ? "the input" : input.name()));
}

std::vector<NamedInput> ToInputs(const v1::Problem& problem, Refusals& refusals) {
  std::vector<NamedInput> inputs;
  for (int i = 0; i < problem.inputs_size(); ++i) {
    auto signal = Within({"inputs", i}, ToSignal(problem.inputs(i)));
    inputs.push_back({problem.inputs(i).name(),
                      ValueOr<InputSpecification>(std::move(signal), ConstantInput{}, refusals)});
  }
  return inputs;
}

std::vector<MeasuredOutput> ToMeasured(const v1::Problem& problem, Refusals& refusals) {
  std::vector<MeasuredOutput> measured;
  for (int i = 0; i < problem.measured_size(); ++i) {
    const v1::MeasuredOutput& output = problem.measured(i);
    auto noise = Within({"measured", i, "noise"}, ToNoise(output.noise()));
    measured.push_back(
        {output.output(), ValueOr<NoiseModel>(std::move(noise), NoiseModel(), refusals)});
  }
  return measured;
}

absl::StatusOr<ExpansionOptions> ToExpansion(const v1::ExpansionOptions& given) {
  ExpansionOptions options;
  if (given.has_order()) options.order = given.order();
  if (given.has_hyperbolic_exponent()) options.hyperbolic_exponent = given.hyperbolic_exponent();
  if (given.points_per_term() != 0) options.points_per_term = given.points_per_term();
  if (given.has_adaptive()) options.adaptive = given.adaptive();
  if (given.has_max_replay_row_count()) options.max_replay_row_count = given.max_replay_row_count();
  switch (given.points()) {
    case v1::ExpansionOptions::POINTS_UNSPECIFIED:
      return options;
    case v1::ExpansionOptions::HALTON:
      options.points = PointSet::kHalton;
      return options;
    case v1::ExpansionOptions::HAMMERSLEY:
      options.points = PointSet::kHammersley;
      return options;
    case v1::ExpansionOptions::GAUSS_TENSOR:
      options.points = PointSet::kGaussTensor;
      return options;
    default:
      return UnknownEnumerator("expansion.points", given.points());
  }
}

absl::StatusOr<IntegrationOptions> ToIntegration(const v1::IntegrationOptions& given) {
  IntegrationOptions options;
  if (given.has_relative_tolerance()) options.relative_tolerance = given.relative_tolerance();
  if (given.has_max_steps()) options.max_steps = given.max_steps();
  switch (given.method()) {
    case v1::IntegrationOptions::METHOD_UNSPECIFIED:
    case v1::IntegrationOptions::AUTO:
      options.method = IntegrationMethod::kAuto;
      return options;
    case v1::IntegrationOptions::EXPLICIT:
      options.method = IntegrationMethod::kExplicit;
      return options;
    case v1::IntegrationOptions::STIFF:
      options.method = IntegrationMethod::kStiff;
      return options;
    default:
      return UnknownEnumerator("integration.method", given.method());
  }
}

absl::StatusOr<RegularizationMode> ToRegularizationMode(v1::Problem::RegularizationMode mode) {
  switch (mode) {
    case v1::Problem::REGULARIZATION_MODE_UNSPECIFIED:
    case v1::Problem::FIXED:
      return RegularizationMode::kFixed;
    case v1::Problem::L_CURVE:
      return RegularizationMode::kLCurve;
    case v1::Problem::DISCREPANCY:
      return RegularizationMode::kDiscrepancy;
    case v1::Problem::EVIDENCE:
      return RegularizationMode::kEvidence;
    default:
      return UnknownEnumerator("regularizationMode", mode);
  }
}

absl::StatusOr<std::optional<LikelihoodForm>> ToLikelihood(v1::Problem::Likelihood likelihood) {
  switch (likelihood) {
    case v1::Problem::LIKELIHOOD_UNSPECIFIED:
      return std::nullopt;
    case v1::Problem::OUTPUT_ERROR:
      return LikelihoodForm::kOutputError;
    case v1::Problem::PREDICTION_ERROR:
      return LikelihoodForm::kPredictionError;
    default:
      return UnknownEnumerator("likelihood", likelihood);
  }
}

std::vector<ProcessNoise> ToProcessNoise(const v1::Problem& given) {
  std::vector<ProcessNoise> process_noise;
  for (const v1::ProcessNoise& noise : given.process_noise()) {
    process_noise.push_back(
        {noise.state(), noise.spectral_density(), noise.unknown(), noise.lower(), noise.upper()});
  }
  return process_noise;
}

// Converts a problem as far as possible and adds its errors to the refusals.
Problem Convert(const v1::Problem& given, const ModelLibrary& models, Refusals& refusals) {
  Problem problem;
  problem.model = ToModel(given, models, refusals);
  problem.fixed = {given.fixed().begin(), given.fixed().end()};
  problem.uncertain = ToUncertain(given, refusals);
  problem.correlations = ToCorrelations(given);
  problem.derived = {given.derived().begin(), given.derived().end()};
  problem.inputs = ToInputs(given, refusals);
  problem.measured = ToMeasured(given, refusals);
  problem.process_noise = ToProcessNoise(given);
  problem.likelihood = ValueOr(ToLikelihood(given.likelihood()), {}, refusals);
  problem.expansion = ValueOr(ToExpansion(given.expansion()), {}, refusals);
  if (given.has_regularization()) problem.regularization = given.regularization();
  problem.regularization_mode = ValueOr(ToRegularizationMode(given.regularization_mode()),
                                        RegularizationMode::kFixed, refusals);
  problem.integration = ValueOr(ToIntegration(given.integration()), {}, refusals);
  problem.use_when = given.use_when();
  problem.tolerance_follows_noise = !given.integration().has_relative_tolerance();
  for (absl::Status& refusal : CheckNamesOfRuns(given)) refusals.push_back(std::move(refusal));
  for (absl::Status& refusal : CheckColumns(given, problem.model.get())) {
    refusals.push_back(std::move(refusal));
  }
  return problem;
}

}  // namespace

std::shared_ptr<const Model> FindModelOf(const v1::Problem& problem, const ModelLibrary& models) {
  Refusals refusals;
  return ToModel(problem, models, refusals);
}

bool UsesFilters(const v1::Problem& given) {
  Refusals unused;
  Problem problem;
  problem.uncertain = ToUncertain(given, unused);
  problem.process_noise = ToProcessNoise(given);
  problem.likelihood = ValueOr(ToLikelihood(given.likelihood()), {}, unused);
  return UsesFilters(problem);
}

absl::StatusOr<ResolvedProblem> ToProblem(const v1::Problem& given, const ModelLibrary& models) {
  POLYEST_RETURN_IF_ERROR(CheckListLengths(given));
  Refusals refusals;
  Problem problem = Convert(given, models, refusals);
  if (!refusals.empty()) return WireFields(refusals.front());
  return WireFields(ResolvedProblem::Make(std::move(problem)));
}

std::vector<absl::Status> CheckProblem(const v1::Problem& given, const ModelLibrary& models) {
  if (absl::Status too_long = CheckListLengths(given); !too_long.ok()) {
    return {std::move(too_long)};
  }
  Refusals refusals;
  Problem problem = Convert(given, models, refusals);
  const bool has_model = problem.model != nullptr;
  for (absl::Status& refusal : ResolvedProblem::Check(std::move(problem))) {
    // Convert has already reported why there is no model.
    if (!has_model && FieldOf(refusal) == FieldPath("model")) continue;
    refusals.push_back(std::move(refusal));
  }
  for (absl::Status& refusal : refusals) refusal = WireFields(refusal);
  return refusals;
}

}  // namespace polyest::internal
