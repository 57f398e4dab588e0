#include "core/propagation/row_variants.h"

#include "core/common/check.h"

namespace polyest::internal {
namespace {

Eigen::Index WholeLanes(Eigen::Index rows) { return (rows + kLanes - 1) / kLanes * kLanes; }

}  // namespace

RowVariants::RowVariants(const SwitchingModel* model, const Eigen::ArrayXXd* parameters,
                         const BlockInputs* inputs, Eigen::Index variants)
    : model_(model),
      natural_(dynamic_cast<const StateSpaceModel*>(model)),
      parameters_of_rows_(parameters),
      inputs_of_rows_(inputs) {
  POLYEST_CHECK(natural_ != nullptr);
  const ModelDescription& description = natural_->description();
  const Eigen::Index rows = WholeLanes(variants);
  const auto switches = static_cast<Eigen::Index>(model->switches().size());
  const auto states = static_cast<Eigen::Index>(description.states.size());
  const auto inputs_number = static_cast<Eigen::Index>(description.inputs.size());
  modes_.setZero(rows, 1 + switches);
  states_.setZero(rows, states);
  parameters_.setZero(rows, static_cast<Eigen::Index>(description.parameters.size()));
  inputs_.setZero(rows, inputs_number);
  rates_.setZero(rows, states);
  outputs_.setZero(rows, static_cast<Eigen::Index>(description.outputs.size()));
  arguments_.setZero(rows, switches);
  slopes_.setZero(rows, switches * (1 + states + inputs_number));
}

void RowVariants::Load(Eigen::Index row, double time_s, const ConstBlock& states,
                       const Eigen::ArrayXXd& modes, Eigen::Index variants) {
  used_ = WholeLanes(variants);
  time_s_ = time_s;
  const auto fill = [this](Eigen::ArrayXXd& to, Eigen::Index column, double value) {
    to.col(column).head(used_).setConstant(value);
  };
  fill(modes_, 0, time_s);
  for (Eigen::Index j = 1; j < modes_.cols(); ++j) fill(modes_, j, modes(row, j));
  for (Eigen::Index j = 0; j < states_.cols(); ++j) fill(states_, j, states(row, j));
  for (Eigen::Index j = 0; j < parameters_.cols(); ++j) {
    fill(parameters_, j, (*parameters_of_rows_)(row, j));
  }
  for (Eigen::Index j = 0; j < inputs_.cols(); ++j) {
    fill(inputs_, j, inputs_of_rows_->At(row, j, time_s));
  }
}

template <class Function>
void RowVariants::Evaluate(Eigen::Index rows, Eigen::ArrayXXd& result, Function function) {
  const ConstBlock modes = modes_.topRows(rows);
  const ConstBlock states = states_.topRows(rows);
  const ConstBlock parameters = parameters_.topRows(rows);
  const ConstBlock inputs = inputs_.topRows(rows);
  function(SwitchingPoint{modes, states, parameters, inputs}, result.topRows(rows));
}

const Eigen::ArrayXXd& RowVariants::Rates() {
  Evaluate(used_, rates_, [this](const SwitchingPoint& at, Block result) {
    model_->FrozenDerivatives(at, result);
  });
  return rates_;
}

const Eigen::ArrayXXd& RowVariants::Outputs() {
  Evaluate(used_, outputs_,
           [this](const SwitchingPoint& at, Block result) { model_->FrozenOutputs(at, result); });
  return outputs_;
}

const Eigen::ArrayXXd& RowVariants::Arguments() {
  Evaluate(kLanes, arguments_,
           [this](const SwitchingPoint& at, Block result) { model_->Arguments(at, result); });
  return arguments_;
}

const Eigen::ArrayXXd& RowVariants::Slopes() {
  Evaluate(kLanes, slopes_,
           [this](const SwitchingPoint& at, Block result) { model_->ArgumentSlopes(at, result); });
  return slopes_;
}

const Eigen::ArrayXXd& RowVariants::NaturalRates() {
  Evaluate(kLanes, rates_, [this](const SwitchingPoint& at, Block result) {
    natural_->Derivatives(time_s_, at.states, at.parameters, at.inputs, result);
  });
  return rates_;
}

const Eigen::ArrayXXd& RowVariants::NaturalOutputs() {
  Evaluate(kLanes, outputs_, [this](const SwitchingPoint& at, Block result) {
    natural_->Outputs(time_s_, at.states, at.parameters, at.inputs, result);
  });
  return outputs_;
}

}  // namespace polyest::internal
