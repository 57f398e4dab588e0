#include "core/estimator/problem/process_noise.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/bayes/noise.h"
#include "core/chaos/germ.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/problem/drifting_model.h"
#include "core/estimator/problem/settable_quantities.h"
#include "core/model/list_names.h"
#include "core/model/switching_model.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {
namespace {

constexpr char kRefusal[] = "is not available with likelihood PREDICTION_ERROR";

bool Drifts(const Problem& problem) {
  return std::ranges::any_of(problem.uncertain, [](const UncertainParameter& parameter) {
    return parameter.drift.has_value();
  });
}

bool HasState(const Problem& problem, const std::string& state) {
  return std::ranges::any_of(problem.model->description().states,
                             [&](const Quantity& quantity) { return quantity.name == state; });
}

// The size of a noise that drives a state: a value, or bounds of an unknown one.
struct Size {
  const char* name;  // of the field
  double value;
  bool unknown;
  double lower, upper;
};

Size SizeOf(const ProcessNoise& noise) {
  return {"spectral_density", noise.spectral_density, noise.unknown, noise.lower, noise.upper};
}

Size SizeOf(const RandomWalk& walk) {
  return {"std_dev_per_sqrt_s", walk.std_dev_per_sqrt_s, walk.unknown, walk.lower, walk.upper};
}

// Over more powers of ten no expansion follows the model.
constexpr double kMinBound = 1e-50, kMaxBound = 1e50, kMaxRatio = 1e20;
constexpr double kMinRatio = 1 + 1e-6;

bool AreBounds(const Size& size) {
  const double ratio = size.upper / size.lower;
  return size.lower >= kMinBound && size.upper <= kMaxBound && ratio >= kMinRatio &&
         ratio <= kMaxRatio;
}

absl::Status CheckSize(const FieldPath& path, const Size& size) {
  const auto field = [&path](const char* name) { return path.Then(name); };
  if (!std::isfinite(size.value) || size.value < 0) {
    return InvalidField(field(size.name),
                        absl::StrFormat("%g must be a finite number ≥ 0", size.value));
  }
  if (!size.unknown) {
    if (size.lower == 0 && size.upper == 0) return absl::OkStatus();
    return InvalidField(field("lower"), absl::StrFormat("%g and upper %g have no effect without "
                                                        "unknown, for which they are bounds",
                                                        size.lower, size.upper));
  }
  if (size.value > 0) {
    return InvalidField(field(size.name),
                        absl::StrFormat("%g is given although it is unknown; give lower and upper "
                                        "instead",
                                        size.value));
  }
  if (AreBounds(size)) return absl::OkStatus();
  return InvalidField(
      field("lower"),
      absl::StrFormat("%g must be above 0 and below upper %g; both must lie between %g and %g, and "
                      "upper be at most %g times lower",
                      size.lower, size.upper, kMinBound, kMaxBound, kMaxRatio));
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
    absl::Status size = CheckSize({"process_noise", i}, SizeOf(noise));
    if (!size.ok()) refusals.push_back(std::move(size));
  }
  return refusals;
}

absl::Status CheckDrift(const Problem& problem, size_t index) {
  const UncertainParameter& parameter = problem.uncertain[index];
  const FieldPath field{"uncertain", index, "drift"};
  const FieldPath walk = field.Then("random_walk");
  POLYEST_RETURN_IF_ERROR(CheckSize(walk, SizeOf(*parameter.drift)));
  if (!parameter.drift->unknown && parameter.drift->std_dev_per_sqrt_s == 0) {
    return InvalidField(walk.Then("std_dev_per_sqrt_s"), "0 must be > 0, or unknown");
  }
  const ModelDescription& model = problem.model->description();
  if (!model.FindParameter(parameter.name)) {
    return InvalidField(field, absl::StrFormat("%s is not a parameter of model %s; only these can "
                                               "drift",
                                               parameter.name, model.name));
  }
  if (dynamic_cast<const StateSpaceModel*>(problem.model.get()) == nullptr) {
    return InvalidField(field, absl::StrFormat("%s cannot drift: model %s takes its parameters at "
                                               "the start of a run only",
                                               parameter.name, model.name));
  }
  return absl::OkStatus();
}

absl::Status CheckModel(const Problem& problem) {
  const Model& model = *problem.model;
  const auto refuse = [&model](absl::string_view why) {
    return InvalidField("likelihood", absl::StrFormat("PREDICTION_ERROR %s, unlike model %s", why,
                                                      model.description().name));
  };
  if (const auto* own = dynamic_cast<const SelfPropagatingModel*>(&model);
      own != nullptr && !own->WhyNotFiltered().empty()) {
    return InvalidField("likelihood",
                        absl::StrFormat("PREDICTION_ERROR needs a model whose states can be set, "
                                        "but %s %s",
                                        model.description().name, own->WhyNotFiltered()));
  }
  const auto walks = std::ranges::count_if(
      problem.uncertain,
      [](const UncertainParameter& parameter) { return parameter.drift.has_value(); });
  const size_t states = model.description().states.size() + static_cast<size_t>(walks);
  if (states < 1 || states > static_cast<size_t>(kMaxFilteredStates)) {
    return refuse(absl::StrFormat(
        "needs a model with 1 to %d states, drifting parameters among them", kMaxFilteredStates));
  }
  const auto* switching = dynamic_cast<const SwitchingModel*>(&model);
  if (switching != nullptr && !switching->switches().empty()) {
    return refuse(
        "needs a model whose equations do not switch; a steep smooth function such as tanh can "
        "stand in for dry friction");
  }
  return absl::OkStatus();
}

absl::Status CheckSensor(size_t index, const MeasuredOutput& measured) {
  const NoiseModel& noise = measured.noise;
  const auto refuse = [index](const char* field) {
    return InvalidField(FieldPath{"measured", index, "noise", field}, kRefusal);
  };
  if (noise.unknown) {
    return InvalidField(FieldPath{"measured", index, "noise", "unknown"},
                        absl::StrCat(kRefusal, "; give it a size and make ",
                                     NoiseName(measured.output), " an uncertain parameter"));
  }
  if (noise.relative > 0) return refuse("relative");
  if (noise.correlation != NoiseCorrelation::kWhite) return refuse("correlation");
  if (noise.outliers == OutlierHandling::kHuber) {
    return InvalidField(FieldPath{"measured", index, "noise", "outliers"},
                        absl::StrCat("HUBER ", kRefusal, "; STUDENT_T is"));
  }
  return absl::OkStatus();
}

// Checks an uncertain parameter that is the noise of a measured output, if there is one.
absl::Status CheckUncertainNoise(const Problem& problem, const MeasuredOutput& measured) {
  const std::string name = NoiseName(measured.output);
  const auto fixed = problem.fixed.find(name);
  if (fixed != problem.fixed.end() && !(fixed->second > 0)) {
    return InvalidField(FieldPath{"fixed", FieldStep::Key(name)},
                        absl::StrFormat("%g must be > 0", fixed->second));
  }
  for (size_t i = 0; i < problem.uncertain.size(); ++i) {
    const UncertainParameter& parameter = problem.uncertain[i];
    if (parameter.name != name) continue;
    if (!(measured.noise.absolute > 0) || measured.noise.relative_to_max > 0) {
      return InvalidField(FieldPath{"uncertain", i},
                          absl::StrCat(name, " needs noise of output ", measured.output,
                                       " that is stated by `absolute` alone"));
    }
    if (!(parameter.ToParameter(Germ(parameter.germ).Lower()) >= 0)) {
      return InvalidField(FieldPath{"uncertain", i},
                          absl::StrCat(name,
                                       " must be positive; give it a lognormal prior or one "
                                       "with a lower bound"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

bool UsesFilters(const Problem& problem) {
  if (problem.likelihood) return *problem.likelihood == LikelihoodForm::kPredictionError;
  return !problem.process_noise.empty() || Drifts(problem);
}

std::string SpectralDensityName(const std::string& state) {
  return absl::StrCat("processNoise.", state);
}

Problem WithHyperparameters(Problem problem) {
  const auto add = [&problem](const std::string& name, const Size& size) {
    const bool there = std::ranges::any_of(
        problem.uncertain,
        [&name](const UncertainParameter& parameter) { return parameter.name == name; });
    if (there || !size.unknown || !AreBounds(size)) return;
    auto parameter = UncertainParameter::LogUniform(name, size.lower, size.upper);
    if (parameter.ok()) problem.uncertain.push_back(*std::move(parameter));
  };
  for (const ProcessNoise& noise : problem.process_noise) {
    add(SpectralDensityName(noise.state), SizeOf(noise));
  }
  const std::vector<UncertainParameter> given = problem.uncertain;
  for (const UncertainParameter& parameter : given) {
    if (parameter.drift) add(DriftName(parameter.name), SizeOf(*parameter.drift));
  }
  return problem;
}

std::shared_ptr<const Model> WithDrifts(const Problem& problem) {
  if (!Drifts(problem)) return problem.model;
  return std::make_shared<DriftingModel>(problem);
}

std::vector<absl::Status> CheckFilters(const Problem& problem) {
  if (problem.model == nullptr) return {};
  std::vector<absl::Status> refusals = CheckEach(problem);
  const auto add = [&refusals](absl::Status status) {
    if (!status.ok()) refusals.push_back(std::move(status));
  };
  for (size_t i = 0; i < problem.uncertain.size(); ++i) {
    if (problem.uncertain[i].drift) add(CheckDrift(problem, i));
  }
  if (!UsesFilters(problem)) {
    if (problem.process_noise.empty() && !Drifts(problem)) return refusals;
    add(InvalidField("likelihood",
                     "OUTPUT_ERROR takes the model for perfect and leaves no room for "
                     "processNoise and drift; use PREDICTION_ERROR"));
    return refusals;
  }
  add(CheckModel(problem));
  for (size_t i = 0; i < problem.uncertain.size(); ++i) {
    const UncertainParameter& parameter = problem.uncertain[i];
    if (parameter.population) add(InvalidField({"uncertain", i, "population"}, kRefusal));
    if (parameter.per_run && parameter.drift) {
      add(InvalidField({"uncertain", i, "per_run"},
                       "is not available for a parameter that drifts"));
    }
  }
  for (size_t i = 0; i < problem.measured.size(); ++i) {
    add(CheckSensor(i, problem.measured[i]));
    add(CheckUncertainNoise(problem, problem.measured[i]));
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
