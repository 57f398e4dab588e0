#include "core/estimator/problem/process_noise.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/bayes/noise.h"
#include "core/common/field_error.h"
#include "core/model/list_names.h"
#include "core/model/switching_model.h"

namespace polyest::internal {
namespace {

constexpr char kRefusal[] = "is not available with likelihood PREDICTION_ERROR";

bool HasState(const Problem& problem, const std::string& state) {
  return std::ranges::any_of(problem.model->description().states,
                             [&](const Quantity& quantity) { return quantity.name == state; });
}

bool AreBounds(const ProcessNoise& noise) {
  return noise.lower > 0 && noise.lower < noise.upper && std::isfinite(noise.upper);
}

absl::Status CheckSize(size_t index, const ProcessNoise& noise) {
  const auto field = [index](const char* name) { return FieldPath{"process_noise", index, name}; };
  if (!std::isfinite(noise.spectral_density) || noise.spectral_density < 0) {
    return InvalidField(field("spectral_density"),
                        absl::StrFormat("%g must be a finite number ≥ 0", noise.spectral_density));
  }
  if (!noise.unknown) {
    if (noise.lower == 0 && noise.upper == 0) return absl::OkStatus();
    return InvalidField(field("lower"), absl::StrFormat("%g and upper %g have no effect without "
                                                        "unknown, for which they are bounds",
                                                        noise.lower, noise.upper));
  }
  if (noise.spectral_density > 0) {
    return InvalidField(field("spectral_density"),
                        absl::StrFormat("%g is given although it is unknown; give lower and upper "
                                        "instead",
                                        noise.spectral_density));
  }
  if (AreBounds(noise)) return absl::OkStatus();
  return InvalidField(field("lower"), absl::StrFormat("%g must be above 0 and below upper %g, "
                                                      "which must be finite",
                                                      noise.lower, noise.upper));
}

std::vector<absl::Status> CheckEach(const Problem& problem) {
  std::vector<absl::Status> refusals;
  std::set<std::string> seen;
  for (size_t i = 0; i < problem.process_noise.size(); ++i) {
    const ProcessNoise& noise = problem.process_noise[i];
    const FieldPath field{"process_noise", i, "state"};
    const ModelDescription& model = problem.model->description();
    if (!HasState(problem, noise.state)) {
      const std::string known = ListNames(model.states);
      refusals.push_back(
          InvalidField(field, absl::StrFormat("model %s has no state \"%s\"; it has %s", model.name,
                                              noise.state, known.empty() ? "none" : known)));
    } else if (!seen.insert(noise.state).second) {
      refusals.push_back(
          InvalidField(field, absl::StrFormat("state %s is given twice", noise.state)));
    }
    if (absl::Status size = CheckSize(i, noise); !size.ok()) refusals.push_back(std::move(size));
  }
  return refusals;
}

absl::Status CheckModel(const Problem& problem) {
  const Model& model = *problem.model;
  const auto refuse = [&model](absl::string_view why) {
    return InvalidField("likelihood", absl::StrFormat("PREDICTION_ERROR %s, unlike model %s", why,
                                                      model.description().name));
  };
  if (dynamic_cast<const StateSpaceModel*>(&model) == nullptr) {
    return refuse("needs a model whose states can be set: a built-in one or equations");
  }
  const size_t states = model.description().states.size();
  if (states < 1 || states > static_cast<size_t>(kMaxFilteredStates)) {
    return refuse(absl::StrFormat("needs a model with 1 to %d states", kMaxFilteredStates));
  }
  const auto* switching = dynamic_cast<const SwitchingModel*>(&model);
  if (switching != nullptr && !switching->switches().empty()) {
    return refuse(
        "needs a model whose equations do not switch; a steep smooth function such as tanh can "
        "stand in for dry friction");
  }
  return absl::OkStatus();
}

absl::Status CheckSensor(size_t index, const NoiseModel& noise) {
  const auto refuse = [index](const char* field) {
    return InvalidField(FieldPath{"measured", index, "noise", field}, kRefusal);
  };
  if (noise.unknown) return refuse("unknown");
  if (noise.relative > 0) return refuse("relative");
  if (noise.correlation != NoiseCorrelation::kWhite) return refuse("correlation");
  if (noise.outliers != OutlierHandling::kNone) return refuse("outliers");
  return absl::OkStatus();
}

}  // namespace

bool UsesFilters(const Problem& problem) {
  return problem.likelihood.value_or(problem.process_noise.empty()
                                         ? LikelihoodForm::kOutputError
                                         : LikelihoodForm::kPredictionError) ==
         LikelihoodForm::kPredictionError;
}

std::string SpectralDensityName(const std::string& state) {
  return absl::StrCat("processNoise.", state);
}

Problem WithSpectralDensities(Problem problem) {
  for (const ProcessNoise& noise : problem.process_noise) {
    const std::string name = SpectralDensityName(noise.state);
    const bool there = std::ranges::any_of(
        problem.uncertain,
        [&name](const UncertainParameter& parameter) { return parameter.name == name; });
    if (there || !noise.unknown || !AreBounds(noise)) continue;
    auto parameter = UncertainParameter::LogUniform(name, noise.lower, noise.upper);
    if (parameter.ok()) problem.uncertain.push_back(*std::move(parameter));
  }
  return problem;
}

std::vector<absl::Status> CheckFilters(const Problem& problem) {
  if (problem.model == nullptr) return {};
  std::vector<absl::Status> refusals = CheckEach(problem);
  const auto add = [&refusals](absl::Status status) {
    if (!status.ok()) refusals.push_back(std::move(status));
  };
  if (!UsesFilters(problem)) {
    if (problem.process_noise.empty()) return refusals;
    add(InvalidField("likelihood",
                     "OUTPUT_ERROR takes the model for perfect and leaves no room for "
                     "processNoise; use PREDICTION_ERROR"));
    return refusals;
  }
  add(CheckModel(problem));
  for (size_t i = 0; i < problem.uncertain.size(); ++i) {
    if (problem.uncertain[i].per_run) add(InvalidField({"uncertain", i, "per_run"}, kRefusal));
  }
  for (size_t i = 0; i < problem.measured.size(); ++i) {
    add(CheckSensor(i, problem.measured[i].noise));
  }
  if (problem.regularization_mode != RegularizationMode::kFixed) {
    add(InvalidField("regularization_mode", absl::StrCat("other than FIXED ", kRefusal)));
  }
  return refusals;
}

absl::Status RefuseFilters(const Problem& problem, const std::string& what) {
  if (!UsesFilters(problem)) return absl::OkStatus();
  return InvalidField("likelihood", absl::StrCat("PREDICTION_ERROR is not available for ", what,
                                                 ", which takes the model for perfect"));
}

}  // namespace polyest::internal
