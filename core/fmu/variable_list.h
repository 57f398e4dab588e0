#pragma once

// The variables of a modelDescription.xml, and their classification into states, parameters, inputs
// and outputs of the model.

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <pugixml.hpp>
#include <string>
#include <vector>

#include "core/fmu/fmu_description.h"

namespace polyest::internal {

// Returns FailedPrecondition that says what is wrong with a modelDescription.xml.
absl::Status WrongDescription(const std::string& what);

class VariableList {
 public:
  // Reads the variables below `root`, the fmiModelDescription element. Returns FailedPrecondition
  // with the reason if the description is invalid.
  static absl::StatusOr<VariableList> Read(const pugi::xml_node& root, int version);

  // Fills the quantities of `description`. Returns the names of the parameters and inputs that keep
  // their start values: those that are not a scalar real number, and discrete inputs for Model
  // Exchange.
  absl::StatusOr<std::vector<std::string>> Sort(FmuKind kind, FmuDescription& description) const;

 private:
  struct Variable {
    Quantity quantity;
    FmuVariable variable;
    bool is_real = false;  // real and scalar
    std::string causality, variability, initial;
    bool has_start = false;
    int derivative_of = 0;  // FMI 2: 1-based index; FMI 3: value reference; see is_derivative
    bool is_derivative = false;
    bool is_state = false;
  };

  using Units = absl::flat_hash_map<std::string, std::string>;  // by type name

  absl::Status Add2(const pugi::xml_node& node, const Units& units);
  absl::Status Add3(const pugi::xml_node& node, const Units& units);
  absl::Status AddCommon(const pugi::xml_node& node, const pugi::xml_node& type, const Units& units,
                         Variable variable);
  absl::Status FindStates2(const pugi::xml_node& structure);
  absl::Status FindStates3(const pugi::xml_node& structure);
  absl::Status AddState(const Variable& derivative, size_t state);
  // Notes whether the derivative may depend on the independent variable. `unknown` is its element
  // of the model structure.
  void NoteTime(const pugi::xml_node& unknown, int version);

  // Adds a real variable to the quantities that it is one of. `state_of`: states by value
  // reference.
  static void AddReal(const Variable& variable, const absl::flat_hash_map<uint32_t, int>& state_of,
                      FmuDescription& description);

  std::vector<Variable> variables_;
  std::vector<size_t> states_;  // in the order of the FMU's state vector
  bool derivatives_use_time_ = false;
  int event_indicators_ = 0;
};

}  // namespace polyest::internal
