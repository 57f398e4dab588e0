#include "core/estimator/problem/resolved_problem.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/nearest_name.h"
#include "core/common/status.h"
#include "core/estimator/problem/output_delay.h"
#include "core/estimator/problem/parameters_of_runs.h"
#include "core/estimator/problem/populations.h"
#include "core/estimator/problem/process_noise.h"
#include "core/estimator/problem/truncation.h"
#include "core/estimator/problem/validate_noise.h"
#include "core/estimator/problem/validate_regularization.h"
#include "core/model/list_names.h"

namespace polyest::internal {
namespace {

constexpr double kMaxFixed = 1e100;  // as of the numbers of a prior

// Refuses a name that is none of the `known` ones, which `list` shows.
absl::Status UnknownName(const FieldPath& field, const std::string& name, const char* kind,
                         const ModelDescription& model, const std::vector<std::string>& known,
                         const std::string& list) {
  const std::string nearest = NearestName(name, known);
  const std::string hint = nearest.empty() ? absl::StrCat("it has ", list.empty() ? "none" : list)
                                           : absl::StrCat("did you mean \"", nearest, "\"?");
  return InvalidField(
      field, absl::StrFormat("model %s has no %s \"%s\"; %s", model.name, kind, name, hint));
}

absl::Status UnknownName(const FieldPath& field, const std::string& name, const char* kind,
                         const ModelDescription& model, const std::vector<Quantity>& known) {
  return UnknownName(field, name, kind, model, NamesOf(known), ListNames(known));
}

absl::Status ValidateGerms(const ExpansionOptions& options, const Prior& prior) {
  for (int i = 0; i < prior.dimension(); ++i) {
    if (prior.germs()[static_cast<size_t>(i)].family() != GermFamily::kTruncatedNormal) continue;
    const int order = FirstTruncation(options, prior.dimension()).order;
    if (order <= Germ::kMaxTruncatedNormalOrder) return absl::OkStatus();
    return InvalidField(
        "expansion.order",
        absl::StrFormat("%d must be at most %d with the truncated normal prior of %s", order,
                        Germ::kMaxTruncatedNormalOrder,
                        prior.parameters()[static_cast<size_t>(i)].name));
  }
  return absl::OkStatus();
}

absl::Status ValidatePriors(const Problem& problem) {
  for (size_t i = 0; i < problem.uncertain.size(); ++i) {
    POLYEST_RETURN_IF_ERROR(Within({"uncertain", i}, problem.uncertain[i].Validate()));
  }
  return absl::OkStatus();
}

// A record of four intervals between checkpoints is always propagated again.
absl::Status ValidateReplayLimit(const Problem& problem) {
  const std::optional<int64_t>& limit = problem.expansion.max_replay_row_count;
  if (!limit) return absl::OkStatus();
  const FieldPath field{"expansion", "max_replay_row_count"};
  POLYEST_RETURN_IF_ERROR(
      CheckAtLeast(field, *limit, 4 * int64_t{problem.integration.samples_between_checkpoints}));
  for (const UncertainParameter& parameter : problem.uncertain) {
    if (!parameter.per_run) continue;
    return InvalidField(
        field, absl::StrCat("is not available with a parameter of each run, ", parameter.name,
                            ": a new run propagates the whole record again"));
  }
  return absl::OkStatus();
}

// Returns the errors that can be found without examining the model.
std::vector<absl::Status> CheckOptions(const Problem& problem, int runs, int first_run) {
  std::vector<absl::Status> refusals;
  const auto add = [&refusals](absl::Status status) {
    if (!status.ok()) refusals.push_back(std::move(status));
  };
  if (problem.model == nullptr) add(InvalidField("model", "a model must be given"));
  for (absl::Status& status : CheckFilters(problem)) add(std::move(status));
  if (problem.uncertain.empty()) {
    add(InvalidField("uncertain", "at least one parameter must be uncertain"));
  }
  add(ValidateRegularization(problem));
  add(ValidatePopulations(problem));
  add(ValidateReplayLimit(problem));
  if (const absl::Status priors = ValidatePriors(problem); !priors.ok()) {
    add(priors);
  } else if (!problem.uncertain.empty()) {
    const auto parameters = ParametersOfRuns(problem.uncertain, runs, first_run);
    add(problem.expansion.Validate(static_cast<int>(parameters.size())));
    // The prior of more than any expansion bears, whose matrices are large, is not made.
    if (parameters.size() <= kMaxTerms) {
      const absl::StatusOr<Prior> prior =
          PriorOfRuns(problem.uncertain, problem.correlations, runs, first_run);
      add(prior.ok() ? ValidateGerms(problem.expansion, *prior) : prior.status());
    }
  }
  if (const absl::Status status = problem.integration.Validate(); !status.ok()) {
    add(Within("integration", status));
  }
  for (size_t i = 0; i < problem.inputs.size(); ++i) {
    add(Within({"inputs", i}, InputSignal::Make(problem.inputs[i].signal).status()));
  }
  for (size_t i = 0; i < problem.measured.size(); ++i) {
    add(ValidateNoise(static_cast<int>(i), problem.measured[i]));
  }
  return refusals;
}

}  // namespace

// Resolves every name of a problem in its model, and collects the errors.
class ResolvedProblem::Resolver {
 public:
  explicit Resolver(ResolvedProblem& resolved)
      : resolved_(resolved),
        problem_(resolved.problem_),
        model_(problem_.model->description()),
        settable_(resolved.settable_) {}

  std::vector<absl::Status> Run() {
    ResolveInputs();
    ResolveMeasured();
    ResolveFixed();
    ResolveUncertain();
    ResolveDerived();
    ResolveGate();
    CheckAllHaveValues();
    if (resolved_.uses_filters() && resolved_.delays_outputs_) {
      Refuse("likelihood", "PREDICTION_ERROR is not available with a delay of an output");
    }
    return std::move(refusals_);
  }

 private:
  void Refuse(absl::Status refusal) { refusals_.push_back(std::move(refusal)); }
  template <class... Arguments>
  void Refuse(const FieldPath& field, const absl::FormatSpec<Arguments...>& format,
              const Arguments&... arguments) {
    Refuse(InvalidField(field, absl::StrFormat(format, arguments...)));
  }

  void ResolveInputs();
  void ResolveMeasured();
  void ResolveFixed();
  void ResolveUncertain();
  void ResolveDerived();
  void ResolveGate();
  void CheckAllHaveValues();
  std::optional<int> Find(const FieldPath& field, const std::string& name);
  bool Driven(int input) const { return signals_.contains(input); }
  bool Measured(int output) const;
  void ResolveDelay(const FieldPath& field, const SettableQuantities::Settable& delay,
                    double smallest_s, double largest_s);

  ResolvedProblem& resolved_;
  const Problem& problem_;
  const ModelDescription& model_;
  const SettableQuantities& settable_;
  std::set<int> signals_;  // inputs that have a signal
  std::vector<bool> has_value_ = std::vector<bool>(static_cast<size_t>(settable_.size()));
  std::vector<absl::Status> refusals_;
};

void ResolvedProblem::Resolver::ResolveInputs() {
  std::map<int, int> needed;  // knots, by column of a streamed input
  for (size_t i = 0; i < problem_.inputs.size(); ++i) {
    const NamedInput& input = problem_.inputs[i];
    const FieldPath field{"inputs", i};
    const auto column = model_.FindInput(input.name);
    if (!column) {
      Refuse(UnknownName(field, input.name, "input", model_, model_.inputs));
      continue;
    }
    if (!signals_.insert(*column).second) {
      Refuse(field, "input %s is given twice", input.name);
      continue;
    }
    const absl::StatusOr<InputSignal> signal = InputSignal::Make(input.signal);
    if (!signal.ok()) continue;  // reported by CheckOptions
    resolved_.base_[settable_.Amplitude(*column)] = signal->default_amplitude();
    if (!signal->streamed()) continue;
    resolved_.streamed_inputs_.push_back(*column);
    needed[*column] = signal->knots_needed();
  }
  std::sort(resolved_.streamed_inputs_.begin(), resolved_.streamed_inputs_.end());
  for (const auto& [column, knots] : needed) resolved_.knots_needed_.push_back(knots);
}

void ResolvedProblem::Resolver::ResolveMeasured() {
  for (size_t i = 0; i < problem_.measured.size(); ++i) {
    const MeasuredOutput& measured = problem_.measured[i];
    const FieldPath field{"measured", i};
    const auto column = model_.FindOutput(measured.output);
    if (!column) {
      Refuse(UnknownName(field, measured.output, "output", model_, model_.outputs));
      continue;
    }
    if (Measured(*column)) Refuse(field, "output %s is given twice", measured.output);
    resolved_.outputs_.push_back(*column);
  }
  resolved_.used_from_s_.assign(problem_.measured.size(), 0);
}

bool ResolvedProblem::Resolver::Measured(int output) const {
  return std::count(resolved_.outputs_.begin(), resolved_.outputs_.end(), output) > 0;
}

// Returns the settable quantity of that name, if setting it has an effect.
std::optional<int> ResolvedProblem::Resolver::Find(const FieldPath& field,
                                                   const std::string& name) {
  const auto index = settable_.Find(name);
  if (!index) {
    Refuse(UnknownName(field, name, "parameter", model_, settable_.Names(), settable_.Describe()));
    return std::nullopt;
  }
  const SettableQuantities::Settable& settable = settable_[*index];
  const auto column = static_cast<size_t>(settable.column);
  if (settable.of_input() && settable.kind != SettableQuantities::Kind::kInputOffset &&
      !Driven(settable.column)) {
    Refuse(field, "%s needs a signal for input %s in inputs", name, model_.inputs[column].name);
    return std::nullopt;
  }
  if (settable.of_output() && !problem_.measured.empty() && !Measured(settable.column)) {
    Refuse(field, "%s needs output %s in measured", name, model_.outputs[column].name);
    return std::nullopt;
  }
  has_value_[static_cast<size_t>(*index)] = true;
  return index;
}

void ResolvedProblem::Resolver::ResolveDelay(const FieldPath& field,
                                             const SettableQuantities::Settable& delay,
                                             double smallest_s, double largest_s) {
  if (!delay.is_delay()) return;
  const auto& streamed = resolved_.streamed_inputs_;
  if (delay.of_input()) {
    if (std::ranges::find(streamed, delay.column) == streamed.end()) return;
    if (!std::isfinite(smallest_s)) {
      return Refuse(field,
                    "the delay %s of a streamed input needs a lower bound, since samples wait for "
                    "the values of the input that they need",
                    delay.name);
    }
    resolved_.input_lead_s_ = std::max(resolved_.input_lead_s_, -smallest_s);
    return;
  }
  absl::Status check = CheckOutputDelay(field, delay.name, smallest_s, largest_s);
  if (!check.ok()) return Refuse(std::move(check));
  if (!streamed.empty()) {
    resolved_.output_lead_s_ = std::max(resolved_.output_lead_s_, -smallest_s);
  }
  resolved_.delays_outputs_ = resolved_.delays_outputs_ || smallest_s != 0 || largest_s != 0;
  for (size_t c = 0; c < resolved_.outputs_.size(); ++c) {
    if (resolved_.outputs_[c] == delay.column) {
      resolved_.used_from_s_[c] = std::max(0.0, largest_s);
    }
  }
}

void ResolvedProblem::Resolver::ResolveFixed() {
  for (const auto& [name, value] : problem_.fixed) {
    const FieldPath field{"fixed", FieldStep::Key(name)};
    const auto index = Find(field, name);
    if (!index) continue;
    if (!(std::abs(value) <= kMaxFixed)) {
      Refuse(field, "%g must be finite and at most %g in magnitude", value, kMaxFixed);
    }
    ResolveDelay(field, settable_[*index], value, value);
    resolved_.base_[*index] = value;
  }
}

void ResolvedProblem::Resolver::ResolveUncertain() {
  std::set<std::string> seen;
  std::vector<std::optional<int>> found(problem_.uncertain.size());
  for (size_t i = 0; i < problem_.uncertain.size(); ++i) {
    const UncertainParameter& parameter = problem_.uncertain[i];
    if (parameter.part != PopulationPart::kNone) continue;
    const FieldPath field{"uncertain", i};
    const auto index = Find(field, parameter.name);
    if (!index) continue;
    if (!seen.insert(parameter.name).second) {
      Refuse(field, "%s is given twice", parameter.name);
    }
    if (problem_.fixed.contains(parameter.name)) {
      Refuse(field, "%s is both fixed and uncertain", parameter.name);
    }
    const auto [smallest, largest] =
        std::minmax({parameter.ToParameter(Germ(parameter.germ).Lower()),
                     parameter.ToParameter(Germ(parameter.germ).Upper())});
    ResolveDelay(field, settable_[*index], smallest, largest);
    found[i] = *index;
  }
  resolved_.SetTargets(found);
}

void ResolvedProblem::Resolver::ResolveDerived() {
  if (problem_.derived.empty()) return;
  std::vector<std::string> variables;
  for (std::string& name : settable_.Names()) {
    if (!problem_.derived.contains(name)) variables.push_back(std::move(name));
  }
  for (const auto& [name, text] : problem_.derived) {
    const FieldPath field{"derived", FieldStep::Key(name)};
    const auto index = Find(field, name);
    if (!index) continue;
    if (problem_.fixed.contains(name)) Refuse(field, "%s is both fixed and derived", name);
    for (const UncertainParameter& parameter : problem_.uncertain) {
      if (parameter.name == name) Refuse(field, "%s is both uncertain and derived", name);
    }
    if (settable_[*index].is_delay()) {
      Refuse(field, "a delay cannot be derived; derive others from it");
    }
    resolved_.derived_targets_.push_back(*index);
  }
  auto derived = Expressions::Make("derived", problem_.derived, variables);
  if (!derived.ok()) {
    Refuse(derived.status());
    return;
  }
  for (const std::string& variable : variables) {
    resolved_.derived_variables_.push_back(*settable_.Find(variable));
  }
  for (size_t i = 0; i < problem_.uncertain.size(); ++i) {
    const UncertainParameter& parameter = problem_.uncertain[i];
    if (!parameter.drift || !derived->variables_used().contains(parameter.name)) continue;
    Refuse({"uncertain", i, "drift"}, "%s cannot drift, because others are derived from it",
           parameter.name);
  }
  resolved_.derived_ = std::make_shared<const Expressions>(*std::move(derived));
}

void ResolvedProblem::Resolver::ResolveGate() {
  if (problem_.use_when.empty()) return;
  auto gate = RowGate::Make(problem_.use_when);
  if (!gate.ok()) return Refuse(gate.status());
  resolved_.gate_ = std::make_shared<const RowGate>(*std::move(gate));
}

void ResolvedProblem::Resolver::CheckAllHaveValues() {
  for (int i = 0; i < settable_.size(); ++i) {
    if (settable_[i].has_default || has_value_[static_cast<size_t>(i)]) continue;
    Refuse("model",
           "parameter %s of model %s has no default; give it a value in fixed, a prior in "
           "uncertain or an expression in derived",
           settable_[i].name, model_.name);
  }
}

absl::StatusOr<ResolvedProblem> ResolvedProblem::Make(Problem problem, int runs, int first_run) {
  POLYEST_CHECK(runs > first_run && first_run >= 0);
  problem = WithHyperparameters(std::move(problem));
  problem.uncertain = WithPopulations(std::move(problem.uncertain));
  std::vector<absl::Status> refusals = CheckOptions(problem, runs, first_run);
  if (!refusals.empty()) return refusals.front();
  POLYEST_ASSIGN_OR_RETURN(Prior prior,
                           PriorOfRuns(problem.uncertain, problem.correlations, runs, first_run));
  ResolvedProblem resolved(std::move(problem), std::move(prior), runs, first_run);
  refusals = Resolver(resolved).Run();
  if (!refusals.empty()) return refusals.front();
  resolved.model_ = WithDrifts(resolved.problem_);
  return resolved;
}

std::vector<absl::Status> ResolvedProblem::Check(Problem problem) {
  problem = WithHyperparameters(std::move(problem));
  problem.uncertain = WithPopulations(std::move(problem.uncertain));
  std::vector<absl::Status> refusals = CheckOptions(problem, 1, 0);
  if (problem.model == nullptr || !ValidatePriors(problem).ok() ||
      problem.uncertain.size() > kMaxTerms) {
    return refusals;
  }
  // The prior only provides the names, because the correlations may be invalid. It needs at least
  // one parameter; without any, a placeholder that no name refers to is used.
  Prior prior(problem.uncertain.empty() ? std::vector<UncertainParameter>(1) : problem.uncertain);
  ResolvedProblem resolved(std::move(problem), std::move(prior), 1, 0);
  for (absl::Status& refusal : Resolver(resolved).Run()) refusals.push_back(std::move(refusal));
  return refusals;
}

}  // namespace polyest::internal
