#pragma once

// A mechanical model as a first-order system with named quantities,
//
//   dx/dt = f(t, x, θ, u),   x(0) = x_0(θ),   y = h(t, x, θ, u),
//
// evaluated for a whole block of collocation points at once. Initial states are parameters like
// any other (x0, v0, x1_0 …). A model without states is algebraic: y = h(t, θ, u).

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/common/types.h"

namespace polyest {

struct Quantity {
  std::string name;
  std::string unit;          // SI, as in "N/m"; "1" for a plain number
  std::string meaning;       // one line
  double default_value = 0;  // of a parameter; unused for states, inputs, outputs
  bool has_default = true;   // of a parameter; without one it must be given a value
};

struct ModelDescription {
  std::string name;
  std::string summary;    // one line
  std::string equations;  // the equations of motion as text
  std::string source;     // where they come from
  std::vector<Quantity> states;
  std::vector<Quantity> parameters;  // initial states among them
  std::vector<Quantity> inputs;
  std::vector<Quantity> outputs;

  std::optional<int> FindParameter(std::string_view parameter) const;
  std::optional<int> FindInput(std::string_view input) const;
  std::optional<int> FindOutput(std::string_view output) const;
};

// The names in order, comma-separated, for messages that list what there is: "m, c, k, x0, v0", or
// "none".
std::string ListNames(const std::vector<Quantity>& quantities);

// What can be simulated. How, its kind says: by its equations (StateSpaceModel), or by itself
// (SelfPropagatingModel, core/propagation).
class Model {
 public:
  virtual ~Model() = default;
  virtual const ModelDescription& description() const = 0;
};

// Blocks have one row a point and one column a quantity, in the description's order; the number of
// rows is a multiple of kLanes. A model keeps no state between calls and may be used by several
// threads at once.
class StateSpaceModel : public Model {
 public:
  virtual void InitialStates(const ConstBlock& parameters, Block states) const = 0;
  virtual void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                           const ConstBlock& inputs, Block derivatives) const = 0;
  virtual void Outputs(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                       const ConstBlock& inputs, Block outputs) const = 0;

  // Whether StateJacobian is there; differences of Derivatives serve otherwise.
  virtual bool has_state_jacobian() const { return false; }
  // ∂f_i/∂x_s in column s·states + i; rows × states².
  virtual void StateJacobian(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                             const ConstBlock& inputs, Block jacobian) const;
};

}  // namespace polyest
