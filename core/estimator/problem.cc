#include "core/estimator/problem.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "core/chaos/multi_index.h"
#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest {
namespace {

constexpr char kAmplitudeSuffix[] = ".amplitude";

std::vector<std::string> Names(const std::vector<Quantity>& quantities) {
  std::vector<std::string> names;
  for (const Quantity& quantity : quantities) names.push_back(quantity.name);
  return names;
}

// Every name that `fixed` and `uncertain` may use.
std::vector<std::string> SettableNames(const ModelDescription& model) {
  std::vector<std::string> names = Names(model.parameters);
  for (const Quantity& input : model.inputs) {
    names.push_back(absl::StrCat(input.name, kAmplitudeSuffix));
  }
  return names;
}

absl::Status UnknownName(std::string_view field, std::string_view name, std::string_view kind,
                         const ModelDescription& model, const std::vector<std::string>& known) {
  return absl::InvalidArgumentError(
      absl::StrFormat("%s: model %s has no %s \"%s\"; it has %s", field, model.name, kind, name,
                      known.empty() ? "none" : absl::StrJoin(known, ", ")));
}

absl::Status ValidateExpansion(const ExpansionOptions& options, int dimension) {
  if (options.order < 1) {
    return absl::InvalidArgumentError(
        absl::StrFormat("expansion.order: %d must be at least 1", options.order));
  }
  if (!std::isfinite(options.points_per_term) || options.points_per_term < 1) {
    return absl::InvalidArgumentError(
        absl::StrFormat("expansion.pointsPerTerm: %g must be at least 1", options.points_per_term));
  }
  const int64_t terms = TotalDegreeTermCount(dimension, options.order);
  if (terms > kMostTerms) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "expansion.order: order %d of %d uncertain parameters needs %d terms; the limit is %d",
        options.order, dimension, terms, kMostTerms));
  }
  const double points = options.points == PointSet::kGaussTensor
                            ? std::pow(options.order + 1, dimension)
                            : std::ceil(options.points_per_term * static_cast<double>(terms));
  if (points > static_cast<double>(kMostPoints)) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "expansion: %.0f collocation points are needed; the limit is %d", points, kMostPoints));
  }
  // A tensor grid is of the prior alone; a moved expansion has points_per_term points a term.
  const double moved = std::ceil(options.points_per_term * static_cast<double>(terms));
  const double fewest = std::min(points, moved);
  if (options.adaptive && fewest <= static_cast<double>(terms)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "expansion.pointsPerTerm: %g gives %.0f points for %d terms; an adaptive expansion needs "
        "more points than terms to see its own error",
        options.points_per_term, fewest, terms));
  }
  return absl::OkStatus();
}

absl::Status ValidateNoise(int index, const MeasuredOutput& measured) {
  const NoiseModel& noise = measured.noise;
  for (const auto& [field, value] : {std::pair{"absolute", noise.absolute},
                                     {"relative", noise.relative},
                                     {"relativeToMax", noise.relative_to_max}}) {
    if (!std::isfinite(value) || value < 0) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "measured[%d].noise.%s: %g must be a finite number ≥ 0", index, field, value));
    }
  }
  if (noise.absolute + noise.relative + noise.relative_to_max <= 0) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "measured[%d].noise: output %s needs a noise: at least one of absolute, relative, "
        "relativeToMax must be above 0",
        index, measured.output));
  }
  return absl::OkStatus();
}

}  // namespace

std::optional<ResolvedProblem::Target> ResolvedProblem::FindTarget(const ModelDescription& model,
                                                                   std::string_view name) {
  if (auto column = model.FindParameter(name)) return Target{false, *column};
  if (name.ends_with(kAmplitudeSuffix)) {
    name.remove_suffix(std::string_view(kAmplitudeSuffix).size());
    if (auto column = model.FindInput(name)) return Target{true, *column};
  }
  return std::nullopt;
}

absl::StatusOr<ResolvedProblem> ResolvedProblem::Make(Problem problem) {
  if (problem.model == nullptr) return absl::InvalidArgumentError("model: a model must be given");
  if (problem.uncertain.empty()) {
    return absl::InvalidArgumentError("uncertain: at least one parameter must be uncertain");
  }
  if (!std::isfinite(problem.regularization) || problem.regularization < 0) {
    return absl::InvalidArgumentError(
        absl::StrFormat("regularization: %g must be a finite number ≥ 0", problem.regularization));
  }
  POLYEST_RETURN_IF_ERROR(
      ValidateExpansion(problem.expansion, static_cast<int>(problem.uncertain.size())));
  POLYEST_RETURN_IF_ERROR(problem.integration.Validate());
  Prior prior(problem.uncertain);
  ResolvedProblem resolved(std::move(problem), std::move(prior));
  POLYEST_RETURN_IF_ERROR(resolved.ResolveInputs());
  POLYEST_RETURN_IF_ERROR(resolved.ResolveParameters());
  POLYEST_RETURN_IF_ERROR(resolved.ResolveUncertain());
  POLYEST_RETURN_IF_ERROR(resolved.ResolveMeasured());
  return resolved;
}

absl::Status ResolvedProblem::ResolveInputs() {
  const ModelDescription& model = problem_.model->description();
  base_amplitudes_ = Vector::Zero(static_cast<Eigen::Index>(model.inputs.size()));
  std::set<int> seen;
  for (size_t i = 0; i < problem_.inputs.size(); ++i) {
    const NamedInput& input = problem_.inputs[i];
    const std::string field = absl::StrFormat("inputs[%d]", i);
    const auto column = model.FindInput(input.name);
    if (!column) return UnknownName(field, input.name, "input", model, Names(model.inputs));
    if (!seen.insert(*column).second) {
      return absl::InvalidArgumentError(
          absl::StrFormat("%s: input %s is given twice", field, input.name));
    }
    absl::StatusOr<InputSignal> signal = InputSignal::Make(input.signal);
    if (!signal.ok()) {
      return absl::Status(signal.status().code(),
                          absl::StrCat(field, " (", input.name, "): ", signal.status().message()));
    }
    base_amplitudes_[*column] = signal->default_amplitude();
    if (signal->streamed()) streamed_inputs_.push_back(*column);
  }
  std::sort(streamed_inputs_.begin(), streamed_inputs_.end());
  return absl::OkStatus();
}

absl::Status ResolvedProblem::ResolveParameters() {
  const ModelDescription& model = problem_.model->description();
  base_parameters_.resize(static_cast<Eigen::Index>(model.parameters.size()));
  for (size_t i = 0; i < model.parameters.size(); ++i) {
    base_parameters_[static_cast<Eigen::Index>(i)] = model.parameters[i].default_value;
  }
  for (const auto& [name, value] : problem_.fixed) {
    const std::string field = absl::StrCat("fixed.", name);
    const auto target = FindTarget(model, name);
    if (!target) return UnknownName(field, name, "parameter", model, SettableNames(model));
    if (!std::isfinite(value)) {
      return absl::InvalidArgumentError(absl::StrFormat("%s: %g must be finite", field, value));
    }
    POLYEST_RETURN_IF_ERROR(CheckDriven(field, name, *target));
    (target->is_amplitude ? base_amplitudes_ : base_parameters_)[target->column] = value;
  }
  return absl::OkStatus();
}

absl::Status ResolvedProblem::ResolveUncertain() {
  const ModelDescription& model = problem_.model->description();
  std::set<std::string> seen;
  for (size_t i = 0; i < problem_.uncertain.size(); ++i) {
    const std::string& name = problem_.uncertain[i].name;
    const std::string field = absl::StrFormat("uncertain[%d]", i);
    const auto target = FindTarget(model, name);
    if (!target) return UnknownName(field, name, "parameter", model, SettableNames(model));
    if (!seen.insert(name).second) {
      return absl::InvalidArgumentError(absl::StrFormat("%s: %s is given twice", field, name));
    }
    if (problem_.fixed.contains(name)) {
      return absl::InvalidArgumentError(
          absl::StrFormat("%s: %s is both fixed and uncertain", field, name));
    }
    POLYEST_RETURN_IF_ERROR(CheckDriven(field, name, *target));
    targets_.push_back(*target);
    const Quantity& quantity =
        (target->is_amplitude ? model.inputs
                              : model.parameters)[static_cast<size_t>(target->column)];
    units_.push_back(quantity.unit);
  }
  return absl::OkStatus();
}

// The amplitude of an input that has no signal would do nothing.
absl::Status ResolvedProblem::CheckDriven(const std::string& field, const std::string& name,
                                          Target target) const {
  if (!target.is_amplitude) return absl::OkStatus();
  const std::string& input =
      problem_.model->description().inputs[static_cast<size_t>(target.column)].name;
  for (const NamedInput& given : problem_.inputs) {
    if (given.name == input) return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrFormat("%s: %s needs a signal for input %s in inputs", field, name, input));
}

absl::Status ResolvedProblem::ResolveMeasured() {
  const ModelDescription& model = problem_.model->description();
  std::set<int> seen;
  for (size_t i = 0; i < problem_.measured.size(); ++i) {
    const MeasuredOutput& measured = problem_.measured[i];
    const std::string field = absl::StrFormat("measured[%d]", i);
    const auto column = model.FindOutput(measured.output);
    if (!column) return UnknownName(field, measured.output, "output", model, Names(model.outputs));
    if (!seen.insert(*column).second) {
      return absl::InvalidArgumentError(
          absl::StrFormat("%s: output %s is given twice", field, measured.output));
    }
    POLYEST_RETURN_IF_ERROR(ValidateNoise(static_cast<int>(i), measured));
    outputs_.push_back(*column);
  }
  return absl::OkStatus();
}

InputSignals ResolvedProblem::MakeInputs() const {
  const ModelDescription& model = problem_.model->description();
  InputSignals signals;
  for (const Quantity& input : model.inputs) {
    InputSpecification specification = ConstantInput{};
    for (const NamedInput& given : problem_.inputs) {
      if (given.name == input.name) specification = given.signal;
    }
    absl::StatusOr<InputSignal> signal = InputSignal::Make(specification);
    POLYEST_CHECK(signal.ok());
    signals.push_back(*std::move(signal));
  }
  return signals;
}

EnsembleSpecification ResolvedProblem::MakeEnsemble(const ConstMatrixRef& thetas,
                                                    std::vector<int> outputs, int threads) const {
  POLYEST_CHECK(thetas.cols() == dimension());
  EnsembleSpecification specification;
  specification.model = problem_.model;
  specification.parameters = base_parameters_.transpose().replicate(thetas.rows(), 1);
  specification.amplitudes = base_amplitudes_.transpose().replicate(thetas.rows(), 1);
  for (size_t i = 0; i < targets_.size(); ++i) {
    (targets_[i].is_amplitude ? specification.amplitudes : specification.parameters)
        .col(targets_[i].column) = thetas.col(static_cast<Eigen::Index>(i));
  }
  specification.outputs = std::move(outputs);
  specification.integration = problem_.integration;
  specification.threads = threads;
  return specification;
}

}  // namespace polyest
