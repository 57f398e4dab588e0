#pragma once

// A built-in model at a single point (Real = double), for balances that hold exactly, linear
// systems obtained by differences, and closed forms.

#include <array>
#include <string>

#include "core/common/types.h"
#include "polyest/model.h"

namespace polyest::internal::builtin {

template <class Equations>
class ModelAtAPoint {
 public:
  using States = std::array<double, Equations::kStates>;
  using Inputs = std::array<double, Equations::kInputs>;
  using Outputs = std::array<double, Equations::kOutputs>;

  ModelAtAPoint() {
    for (size_t i = 0; i < parameters_.size(); ++i) {
      parameters_[i] = description_.parameters[i].default_value;
    }
  }

  double& operator[](const std::string& parameter) {
    return parameters_.at(static_cast<size_t>(description_.FindParameter(parameter).value()));
  }

  States InitialStates() const {
    States states;
    Equations::Initial(parameters_, states);
    return states;
  }

  States Derivatives(const States& states, const Inputs& inputs) const {
    States derivatives;
    Equations::Derivatives(0, states, parameters_, inputs, derivatives);
    return derivatives;
  }

  double Output(const std::string& output, const States& states, const Inputs& inputs) const {
    Outputs outputs;
    Equations::Outputs(0, states, parameters_, inputs, outputs);
    return outputs.at(static_cast<size_t>(description_.FindOutput(output).value()));
  }

  // Returns ∂ẋ/∂x by central differences; the step is in the states' own units.
  Matrix Jacobian(const States& at, const Inputs& inputs, double step) const {
    Matrix jacobian(Equations::kStates, Equations::kStates);
    for (size_t j = 0; j < at.size(); ++j) {
      States above = at, below = at;
      above[j] += step;
      below[j] -= step;
      jacobian.col(static_cast<Eigen::Index>(j)) =
          (Eigen::Map<const Vector>(Derivatives(above, inputs).data(), Equations::kStates) -
           Eigen::Map<const Vector>(Derivatives(below, inputs).data(), Equations::kStates)) /
          (2 * step);
    }
    return jacobian;
  }

 private:
  ModelDescription description_ = Equations::Describe();
  std::array<double, Equations::kParameters> parameters_;
};

// Returns the rounding error of a few dozen operations on terms of the size `scale`.
inline double Rounding(double scale) { return 1e-13 * scale; }

inline constexpr double kGravity = 9.81;

}  // namespace polyest::internal::builtin
