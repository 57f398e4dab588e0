#pragma once

// A mechanical model as a first-order system with named quantities,
//
//   dx/dt = f(t, x, θ, u),   x(0) = x_0(θ),   y = h(t, x, θ, u),
//
// evaluated for a block of trajectories at once. Initial states are parameters like any other
// (x0, v0, x1_0 …). A model without states is algebraic: y = h(t, θ, u).
//
// To estimate with a model of your own, derive from StateSpaceModel, or write its equations as text
// (polyest/equation_model.h). polyest/catalogue.h has built-in models.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "polyest/types.h"

namespace polyest {

// A state, parameter, input or output of a model.
struct Quantity {
  std::string name;          // unique within its list
  std::string unit;          // such as "N/m"; "1" for a plain number; empty: not given
  std::string meaning;       // one line
  double default_value = 0;  // of a parameter; unused for states, inputs, outputs
  bool has_default = true;   // of a parameter; without one a problem must give it a value
};

// What a model is called and which quantities it has.
struct ModelDescription {
  std::string name;                  // as in a problem file
  std::string summary;               // one line
  std::string equations;             // the equations of motion as text
  std::string source;                // where they come from
  std::vector<Quantity> states;      // x; empty for an algebraic model
  std::vector<Quantity> parameters;  // θ, initial states among them
  std::vector<Quantity> inputs;      // u
  std::vector<Quantity> outputs;     // y, what can be measured
  // What else tells the model from others with the same description, such as the checksum of a
  // file: what was computed with one identity is not used with another one. Empty for equations.
  std::string identity{};

  // Returns the parameter's index in `parameters`; nothing when there is none of this name.
  std::optional<int> FindParameter(std::string_view parameter) const;
  // Returns the input's index in `inputs`; nothing when there is none of this name.
  std::optional<int> FindInput(std::string_view input) const;
  // Returns the output's index in `outputs`; nothing when there is none of this name.
  std::optional<int> FindOutput(std::string_view output) const;
};

// Something that can be simulated. Models of users derive from StateSpaceModel.
class Model {
 public:
  virtual ~Model() = default;
  // Returns the same description each time; it lives as long as the model.
  virtual const ModelDescription& description() const = 0;
};

// A model that is known by its equations.
//
// Blocks have one row for each trajectory and one column for each quantity, in the description's
// order; the number of rows is a multiple of kLanes. All numbers are in SI units. A row that has no
// value (the square root of a negative length) is written as NaN: its trajectory is then left out
// and reported. A model keeps no state between calls, and several threads may call it at once.
class StateSpaceModel : public Model {
 public:
  // Writes x_0(θ). parameters: rows × parameters; states: rows × states.
  virtual void InitialStates(const ConstBlock& parameters, Block states) const = 0;
  // Writes dx/dt = f(t, x, θ, u). states and derivatives: rows × states; inputs: rows × inputs.
  virtual void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                           const ConstBlock& inputs, Block derivatives) const = 0;
  // Writes y = h(t, x, θ, u). outputs: rows × outputs.
  virtual void Outputs(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                       const ConstBlock& inputs, Block outputs) const = 0;

  // Whether f may depend on time_s itself and not only through u. An integrator then takes no step
  // longer than the interval between two samples, so that it cannot step over what f does in time.
  // By default it may.
  virtual bool uses_time() const { return true; }
  // Returns whether f(t, x, θ, u) = A x + B v + c for every x and v, where v are the inputs that
  // vary, and A, B and c depend on nothing but θ and the other inputs. It must hold for all θ whose
  // parameters marked in `zero_parameters` are 0; inputs marked in `constant_inputs` do not vary.
  // Such a model is stepped without error of integration. By default nothing is known, so false.
  virtual bool IsLinear(const std::vector<bool>& /*zero_parameters*/,          // by parameter
                        const std::vector<bool>& /*constant_inputs*/) const {  // by input
    return false;
  }

  // Whether StateJacobian is implemented. By default it is not, and differences of Derivatives
  // stand in for it where a stiff model needs it.
  virtual bool has_state_jacobian() const { return false; }
  // Writes ∂f_i/∂x_s into column s·states + i. jacobian: rows × states².
  virtual void StateJacobian(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                             const ConstBlock& inputs, Block jacobian) const;
};

}  // namespace polyest
