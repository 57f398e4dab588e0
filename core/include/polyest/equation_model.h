#pragma once

// A model as its user writes it: equations as text, such as
//
//   states   {"x": "v", "v": "(F - c*v - k*x)/m"}      right-hand sides of dx/dt
//   outputs  {"x": "x"}
//   inputs   {"F"}
//
// core/model/equations/README.md in polyest's sources describes the language. Nothing but
// arithmetic can be expressed: no loops, no memory, no files.

#include <absl/status/statusor.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "polyest/model.h"

namespace polyest {

// A function given by values on a grid, called in an expression by its name: name(x) or name(x, y).
// Outside of the grid its value is that of the nearest end and its slope 0.
struct LookupTable {
  std::vector<double> x = {};      // at least two, strictly increasing
  std::vector<double> y = {};      // empty for one dimension; else at least two, increasing
  std::vector<double> value = {};  // x.size(), or row-major x.size() × y.size()
  bool spline = false;             // false: linear; true: natural cubic (bicubic) spline
};

// A name in the equations that no member of this struct defines is a parameter without a default.
// The initial value of a state x is the parameter x_0, which is 0 unless `parameters` says
// otherwise.
struct EquationSpecification {
  std::map<std::string, std::string> states = {};   // name → right-hand side of dx/dt
  std::map<std::string, std::string> outputs = {};  // name → expression; at least one
  // Named expressions that others use; they may use each other, without a cycle.
  std::map<std::string, std::string> intermediates = {};
  std::map<std::string, double> parameters = {};   // name → default; may include <state>_0
  std::vector<std::string> inputs = {};            // names, in the model's order
  std::map<std::string, std::string> units = {};   // name → unit; x_0 has the unit of x
  std::map<std::string, LookupTable> tables = {};  // name → function
};

// Makes a model from its equations; its Jacobian is exact. States, outputs and parameters of the
// model are in alphabetical order, its initial states after the other parameters, and inputs in the
// order given. INVALID_ARGUMENT, or RESOURCE_EXHAUSTED past a limit, begins with the field at
// fault: "model.equations.states.v: column 7: unknown function \"sine\"; …".
absl::StatusOr<std::shared_ptr<const StateSpaceModel>> MakeEquationModel(
    const EquationSpecification& specification);

}  // namespace polyest
