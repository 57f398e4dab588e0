#include "core/fmu/variable_list.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/common/status.h"
#include "core/external/clean_text.h"

namespace polyest::internal {
namespace {

constexpr size_t kMaxVariables = 200'000;
constexpr size_t kLongestVariableName = 1'000;

// Returns the units of the declared types by the type's name.
absl::flat_hash_map<std::string, std::string> TypeUnits(const pugi::xml_node& root, int version) {
  absl::flat_hash_map<std::string, std::string> units;
  for (const pugi::xml_node type : root.child("TypeDefinitions").children()) {
    const pugi::xml_node real = version == 2 ? type.child("Real") : type;
    units[type.attribute("name").value()] = real.attribute("unit").value();
  }
  return units;
}

}  // namespace

absl::Status WrongDescription(const std::string& what) {
  return absl::FailedPreconditionError(absl::StrCat("modelDescription.xml: ", what));
}

absl::StatusOr<VariableList> VariableList::Read(const pugi::xml_node& root, int version) {
  VariableList list;
  const Units units = TypeUnits(root, version);
  for (const pugi::xml_node node : root.child("ModelVariables").children()) {
    if (node.type() != pugi::node_element) continue;
    if (list.variables_.size() == kMaxVariables) {
      return WrongDescription(absl::StrFormat("there are more than %d variables", kMaxVariables));
    }
    POLYEST_RETURN_IF_ERROR(version == 2 ? list.Add2(node, units) : list.Add3(node, units));
  }
  const pugi::xml_node structure = root.child("ModelStructure");
  POLYEST_RETURN_IF_ERROR(version == 2 ? list.FindStates2(structure) : list.FindStates3(structure));
  if (version == 2) list.event_indicators_ = root.attribute("numberOfEventIndicators").as_int();
  if (list.event_indicators_ < 0 || list.event_indicators_ > static_cast<int>(kMaxVariables)) {
    return WrongDescription(
        absl::StrFormat("%d event indicators are not supported", list.event_indicators_));
  }
  return list;
}

absl::Status VariableList::Add2(const pugi::xml_node& node, const Units& units) {
  Variable variable;
  const pugi::xml_node real = node.child("Real");
  variable.is_real = static_cast<bool>(real);
  if (const pugi::xml_attribute derivative = real.attribute("derivative")) {
    variable.is_derivative = true;
    variable.derivative_of = derivative.as_int();
  }
  return AddCommon(node, real, units, std::move(variable));
}

absl::Status VariableList::Add3(const pugi::xml_node& node, const Units& units) {
  Variable variable;
  const std::string type = node.name();
  variable.variable.is_float32 = type == "Float32";
  variable.is_real = (type == "Float64" || type == "Float32") && !node.child("Dimension");
  if (const pugi::xml_attribute derivative = node.attribute("derivative")) {
    variable.is_derivative = true;
    variable.derivative_of = static_cast<int>(derivative.as_uint());
  }
  return AddCommon(node, node, units, std::move(variable));
}

absl::Status VariableList::AddCommon(const pugi::xml_node& node, const pugi::xml_node& type,
                                     const Units& units, Variable variable) {
  Quantity& quantity = variable.quantity;
  quantity.name = CleanText(node.attribute("name").value(), kLongestVariableName + 1);
  if (quantity.name.empty() || quantity.name.size() > kLongestVariableName) {
    return WrongDescription(absl::StrFormat("variable %d must have a name of 1 to %d characters",
                                            variables_.size() + 1, kLongestVariableName));
  }
  quantity.meaning = CleanText(node.attribute("description").value());
  quantity.unit = type.attribute("unit").value();
  if (quantity.unit.empty()) {
    const auto declared = units.find(type.attribute("declaredType").value());
    if (declared != units.end()) quantity.unit = declared->second;
  }
  quantity.unit = CleanText(quantity.unit, 100);
  if (quantity.unit.empty()) quantity.unit = "1";
  variable.variable.reference = node.attribute("valueReference").as_uint();
  variable.causality = node.attribute("causality").as_string("local");
  variable.variability = node.attribute("variability").as_string("continuous");
  variable.initial = node.attribute("initial").value();
  if (const pugi::xml_attribute start = type.attribute("start"); start && variable.is_real) {
    variable.has_start = true;
    if (!absl::SimpleAtod(start.value(), &quantity.default_value) ||
        !std::isfinite(quantity.default_value)) {
      return WrongDescription(
          absl::StrFormat("the start value \"%s\" of %s must be a finite number",
                          CleanText(start.value(), 64), quantity.name));
    }
  }
  variables_.push_back(std::move(variable));
  return absl::OkStatus();
}

absl::Status VariableList::AddState(const Variable& derivative, size_t state) {
  if (!derivative.is_derivative || state >= variables_.size() || !variables_[state].is_real) {
    return WrongDescription(absl::StrFormat(
        "%s must be the derivative of a single real variable; arrays are not supported",
        derivative.quantity.name));
  }
  variables_[state].is_state = true;
  states_.push_back(state);
  return absl::OkStatus();
}

// Dependencies name variables as the rest of the structure does: by 1-based index in FMI 2, by
// value reference in FMI 3. Without the attribute, a derivative depends on everything. What is not
// declared cannot be named.
void VariableList::NoteTime(const pugi::xml_node& unknown, int version) {
  const auto time = std::ranges::find(variables_, "independent", &Variable::causality);
  const pugi::xml_attribute dependencies = unknown.attribute("dependencies");
  if (time == variables_.end() || !dependencies) {
    derivatives_use_time_ = true;
    return;
  }
  const int64_t of_time =
      version == 2 ? time - variables_.begin() + 1 : int64_t{time->variable.reference};
  for (const absl::string_view known :
       absl::StrSplit(dependencies.value(), absl::ByAnyChar(" \t\r\n"), absl::SkipEmpty())) {
    int64_t number = 0;
    const bool is_number = absl::SimpleAtoi(known, &number);
    derivatives_use_time_ = derivatives_use_time_ || !is_number || number == of_time;
  }
}

absl::Status VariableList::FindStates2(const pugi::xml_node& structure) {
  for (const pugi::xml_node unknown : structure.child("Derivatives").children("Unknown")) {
    const size_t index = unknown.attribute("index").as_uint();
    if (index < 1 || index > variables_.size()) {
      return WrongDescription(
          absl::StrFormat("ModelStructure.Derivatives: there is no variable %d", index));
    }
    const Variable derivative = variables_[index - 1];
    POLYEST_RETURN_IF_ERROR(
        AddState(derivative, static_cast<size_t>(derivative.derivative_of) - 1));
    NoteTime(unknown, 2);
  }
  return absl::OkStatus();
}

absl::Status VariableList::FindStates3(const pugi::xml_node& structure) {
  absl::flat_hash_map<uint32_t, size_t> by_reference;
  for (size_t i = 0; i < variables_.size(); ++i) {
    by_reference.emplace(variables_[i].variable.reference, i);
  }
  const auto find = [&](uint32_t reference) {
    const auto found = by_reference.find(reference);
    return found == by_reference.end() ? variables_.size() : found->second;
  };
  for (const pugi::xml_node node : structure.children("ContinuousStateDerivative")) {
    const uint32_t reference = node.attribute("valueReference").as_uint();
    const size_t index = find(reference);
    if (index == variables_.size()) {
      return WrongDescription(absl::StrFormat(
          "ModelStructure.ContinuousStateDerivative: there is no variable with valueReference %d",
          reference));
    }
    const Variable derivative = variables_[index];
    POLYEST_RETURN_IF_ERROR(
        AddState(derivative, find(static_cast<uint32_t>(derivative.derivative_of))));
    NoteTime(node, 3);
  }
  for ([[maybe_unused]] const pugi::xml_node node : structure.children("EventIndicator")) {
    ++event_indicators_;
  }
  return absl::OkStatus();
}

void VariableList::AddReal(const Variable& variable,
                           const absl::flat_hash_map<uint32_t, int>& state_of,
                           FmuDescription& description) {
  ModelDescription& model = description.model;
  const bool is_input = variable.causality == "input";
  // A start value of another variable is a parameter too if initial="exact": it is then set, not
  // computed.
  const bool is_initial_value = variable.initial == "exact" && variable.has_start &&
                                variable.variability != "constant" && !is_input;
  if ((variable.causality == "parameter" && variable.has_start) || is_initial_value) {
    model.parameters.push_back(variable.quantity);
    description.parameters.push_back(variable.variable);
  }
  if (is_input) {
    model.inputs.push_back(variable.quantity);
    description.inputs.push_back(variable.variable);
  }
  if (variable.causality == "output" || variable.is_state) {
    model.outputs.push_back(variable.quantity);
    description.outputs.push_back(variable.variable);
    const auto state = state_of.find(variable.variable.reference);
    if (state != state_of.end()) description.outputs.back().state = state->second;
  }
}

absl::StatusOr<std::vector<std::string>> VariableList::Sort(FmuKind kind,
                                                            FmuDescription& description) const {
  std::vector<std::string> kept;
  absl::flat_hash_set<std::string> names;
  absl::flat_hash_map<uint32_t, int> state_of;  // by value reference, which an alias shares
  for (size_t i = 0; i < states_.size(); ++i) {
    state_of.emplace(variables_[states_[i]].variable.reference, static_cast<int>(i));
  }
  for (const Variable& variable : variables_) {
    const Quantity& quantity = variable.quantity;
    if (!names.insert(quantity.name).second) {
      return WrongDescription(absl::StrFormat("the variable %s is there twice", quantity.name));
    }
    const bool is_parameter = variable.causality == "parameter";
    const bool is_input = variable.causality == "input";
    // Model Exchange accepts discrete inputs only at events, and a signal has none.
    const bool is_discrete = kind == FmuKind::kModelExchange && variable.variability == "discrete";
    if ((is_parameter || is_input) && (!variable.is_real || (is_input && is_discrete))) {
      kept.push_back(quantity.name);
      continue;
    }
    if (variable.is_real && variable.causality != "independent") {
      AddReal(variable, state_of, description);
    }
  }
  for (const size_t state : states_) {
    description.model.states.push_back(variables_[state].quantity);
  }
  description.interface.states = static_cast<int>(states_.size());
  description.interface.derivatives_use_time = derivatives_use_time_;
  description.interface.event_indicators = event_indicators_;
  return kept;
}

}  // namespace polyest::internal
