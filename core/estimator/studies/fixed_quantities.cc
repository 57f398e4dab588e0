#include "core/estimator/studies/fixed_quantities.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/estimator/problem/settable_quantities.h"

namespace polyest::internal {
namespace {

using Settable = SettableQuantities::Settable;
using Kind = SettableQuantities::Kind;

constexpr double kFirstStep = 1e-4;  // of the value
constexpr double kOfInterval = 0.05;

bool IsOfUsedChannel(const ResolvedProblem& problem, const Settable& quantity) {
  if (quantity.of_output() && quantity.kind != Kind::kNoise) {
    return std::ranges::count(problem.outputs(), quantity.column) > 0;
  }
  if (!quantity.of_input() || quantity.kind == Kind::kAmplitude) return false;
  const auto column = static_cast<size_t>(quantity.column);
  const std::string& name = problem.problem().model->description().inputs[column].name;
  return std::ranges::count(problem.problem().inputs, name, &NamedInput::name) > 0;
}

// Returns nothing for a quantity that is uncertain, derived or without a value.
std::optional<double> FixedValue(const Problem& problem, const Settable& quantity) {
  if (problem.derived.contains(quantity.name) ||
      std::ranges::count(problem.uncertain, quantity.name, &UncertainParameter::name) > 0) {
    return std::nullopt;
  }
  const auto fixed = problem.fixed.find(quantity.name);
  if (fixed != problem.fixed.end()) return fixed->second;
  return quantity.has_default ? std::optional(quantity.default_value) : std::nullopt;
}

}  // namespace

std::vector<FixedQuantity> FixedQuantitiesOf(const ResolvedProblem& problem, double interval_s) {
  const SettableQuantities settable(problem.problem().model->description(), problem.problem());
  std::vector<FixedQuantity> channels, parameters;
  for (int i = 0; i < settable.size(); ++i) {
    const Settable& quantity = settable[i];
    const bool is_parameter = quantity.kind == Kind::kParameter;
    if (!is_parameter && !IsOfUsedChannel(problem, quantity)) continue;
    const std::optional<double> value = FixedValue(problem.problem(), quantity);
    if (!value) continue;
    FixedQuantity fixed{.name = quantity.name, .unit = quantity.unit, .value = *value};
    fixed.step = kFirstStep * (*value == 0 ? 1 : std::abs(*value));
    fixed.max_step = kInfinity;
    if (quantity.is_delay()) fixed.step = fixed.max_step = kOfInterval * interval_s;
    fixed.other = fixed.value + fixed.step;
    if (quantity.kind == Kind::kOutputDelay) {
      const auto channel = std::ranges::find(problem.outputs(), quantity.column);
      fixed.delayed_channel = static_cast<int>(channel - problem.outputs().begin());
    }
    (is_parameter ? parameters : channels).push_back(std::move(fixed));
  }
  channels.insert(channels.end(), parameters.begin(), parameters.end());
  return channels;
}

std::optional<ResolvedProblem> WithUncertain(const ResolvedProblem& problem,
                                             const std::vector<FixedQuantity>& quantities) {
  Problem extended = problem.problem();
  for (const FixedQuantity& quantity : quantities) {
    // The priors themselves are not used, except for the bounds of delays.
    const auto [lower, upper] = std::minmax(quantity.value, quantity.other);
    auto uncertain = UncertainParameter::Uniform(quantity.name, lower, upper);
    if (!uncertain.ok()) return std::nullopt;
    extended.uncertain.push_back(*std::move(uncertain));
    extended.fixed.erase(quantity.name);
  }
  extended.expansion.order = 1;
  auto resolved = ResolvedProblem::Make(std::move(extended));
  return resolved.ok() ? std::optional(*std::move(resolved)) : std::nullopt;
}

}  // namespace polyest::internal
