#pragma once

// A model some of whose parameters drift: random walks are states beside its own.
//
// The state g_j of a drifting parameter θ_j begins at 0 and stays there but for process noise:
//
//   dg_j = r_j/s_j dβ_j,   θ_j(t) = F_j⁻¹(Φ(Φ⁻¹(F_j(θ_j)) + g_j(t))),
//
// with F_j the cumulative probability of the prior, s_j its standard deviation and r_j the rate of
// the walk in the parameter's unit/√s. θ_j keeps within the prior's bounds; for a normal prior it
// is θ_j + s_j g_j. What θ_j(t) is can be read as an output of the parameter's name, behind the
// model's own outputs, unless one of these has that name.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "polyest/model.h"
#include "polyest/problem.h"
#include "polyest/uncertain_parameter.h"

namespace polyest::internal {

// Returns the name of the state that a drifting parameter brings and of the settable quantity (and
// uncertain parameter) that is its rate: "k.drift".
std::string DriftName(const std::string& parameter);

// Returns the value to which a step of its normal score by `departure` takes a parameter with the
// prior `parameter` from `theta`.
double Drifted(const UncertainParameter& parameter, double theta, double departure);

class DriftingModel : public StateSpaceModel {
 public:
  // Takes the parameters of `problem` that drift, each of which must be a parameter of its model, a
  // StateSpaceModel that does not switch. Their states follow the model's own in the problem's
  // order.
  explicit DriftingModel(const Problem& problem);

  const ModelDescription& description() const override { return description_; }
  void InitialStates(const ConstBlock& parameters, Block states) const override;
  void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock& inputs, Block derivatives) const override;
  void Outputs(double time_s, const ConstBlock& states, const ConstBlock& parameters,
               const ConstBlock& inputs, Block outputs) const override;
  bool uses_time() const override { return model_->uses_time(); }

 private:
  struct Walk {
    int column;  // of the model's parameters
    UncertainParameter prior;
    bool read;  // whether an output shows it
  };

  // Returns the parameters at those states, in memory of the thread's own.
  const Eigen::ArrayXXd& Present(const ConstBlock& states, const ConstBlock& parameters) const;

  const int64_t number_;  // of the model in this process
  std::shared_ptr<const Model> owner_;
  const StateSpaceModel* model_;
  std::vector<Walk> walks_;
  ModelDescription description_;
};

}  // namespace polyest::internal
