#include "client/cli/state_spread.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

using Output = v1::PredictResponse::Output;

struct StateName {
  std::string name;
  std::string unit;
  bool is_velocity = false;
};

// States and outputs of a model.
struct Described {
  std::vector<StateName> states;
  std::vector<std::string> outputs;
};

// Says whether the state is the derivative of another one.
bool IsDerivative(const std::string& state, const v1::Equations& equations) {
  return std::ranges::any_of(equations.states(),
                             [&](const auto& other) { return other.second == state; });
}

// Describes the model of equations, which gets each state as an output.
Described Describe(v1::Equations& equations) {
  Described model;
  for (const auto& [name, derivative] : equations.states()) {
    const auto unit = equations.units().find(name);
    StateName state{name, unit == equations.units().end() ? "" : unit->second};
    state.is_velocity = absl::EndsWith(state.unit, "/s") || IsDerivative(name, equations);
    model.states.push_back(state);
    if (!equations.outputs().contains(name)) (*equations.mutable_outputs())[name] = name;
  }
  for (const auto& [name, expression] : equations.outputs()) model.outputs.push_back(name);
  return model;
}

absl::StatusOr<Described> Describe(v1::Problem::Model& source, Backend& backend) {
  if (source.has_equations()) return Describe(*source.mutable_equations());
  v1::GetModelRequest request;
  request.set_name(absl::StrCat("models/", source.has_builtin() ? source.builtin()
                                           : source.has_fmu()   ? source.fmu()
                                                                : source.umbridge()));
  POLYEST_ASSIGN_OR_RETURN(const v1::Model described, backend.GetModel(request));
  Described model;
  for (const v1::Model::Quantity& state : described.states()) {
    model.states.push_back({state.name(), state.unit(), absl::EndsWith(state.unit(), "/s")});
  }
  for (const v1::Model::Quantity& output : described.outputs()) {
    model.outputs.push_back(output.name());
  }
  return model;
}

// Returns the standard deviation of the values about their mean.
double Spread(const std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto count = static_cast<double>(values.size());
  double mean = 0;
  for (const double value : values) mean += value / count;
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / count);
}

std::vector<double> Values(const Output& output) {
  return {output.mean().begin(), output.mean().end()};
}

// Returns the difference quotients of the output from one time of a run to the next.
std::vector<double> Rates(const Output& output, const v1::PredictResponse& prediction) {
  std::vector<double> rates;
  for (int k = 1; k < std::min(output.mean_size(), prediction.time_s_size()); ++k) {
    const double step_s = prediction.time_s(k) - prediction.time_s(k - 1);
    const bool same_run = prediction.run().empty() || prediction.run(k) == prediction.run(k - 1);
    if (same_run && step_s > 0) rates.push_back((output.mean(k) - output.mean(k - 1)) / step_s);
  }
  return rates;
}

double SpreadOf(const StateName& state, const v1::PredictResponse& prediction) {
  double largest = 0;
  for (const Output& output : prediction.outputs()) {
    if (output.output() == state.name) return Spread(Values(output));
    if (state.unit.empty() || output.unit().empty()) continue;
    if (output.unit() == state.unit) largest = std::max(largest, Spread(Values(output)));
    if (absl::StrCat(output.unit(), "/s") == state.unit) {
      largest = std::max(largest, Spread(Rates(output, prediction)));
    }
  }
  return largest;
}

}  // namespace

absl::StatusOr<std::vector<StateSpread>> SpreadsOfStates(v1::Experiment experiment,
                                                         Backend& backend) {
  POLYEST_ASSIGN_OR_RETURN(const Described model,
                           Describe(*experiment.mutable_problem()->mutable_model(), backend));
  std::vector<StateSpread> spreads;
  if (model.states.empty()) return spreads;
  v1::PredictRequest request;
  *request.mutable_subject()->mutable_experiment() = std::move(experiment);
  for (const std::string& output : model.outputs) request.add_outputs(output);
  constexpr int kDraws = 20;  // half of which may fail
  request.set_draw_count(kDraws);
  POLYEST_ASSIGN_OR_RETURN(const v1::PredictResponse prediction, backend.Predict(request));
  for (const StateName& state : model.states) {
    const double spread = SpreadOf(state, prediction);
    if (spread > 0 && std::isfinite(spread)) {
      spreads.push_back({state.name, state.is_velocity, spread});
    }
  }
  return spreads;
}

}  // namespace polyest::internal
