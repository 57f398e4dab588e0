#pragma once

// A switching model at one row of a block, evaluated for several settings of its modes at once.

#include "core/common/types.h"
#include "core/model/switching_model.h"
#include "core/propagation/block_inputs.h"
#include "polyest/model.h"

namespace polyest::internal {

class RowVariants {
 public:
  // Has room for `variants` settings. All that is pointed to must outlive the object.
  RowVariants(const SwitchingModel* model, const Eigen::ArrayXXd* parameters,
              const BlockInputs* inputs, Eigen::Index variants);

  // Takes the row, with the modes given in `modes` (rows × (1 + switches)) for each of `variants`
  // settings.
  void Load(Eigen::Index row, double time_s, const ConstBlock& states, const Eigen::ArrayXXd& modes,
            Eigen::Index variants);
  // Sets the mode of a switch in one of the settings.
  void SetMode(Eigen::Index variant, Eigen::Index which, double mode) {
    modes_(variant, 1 + which) = mode;
  }

  // Each of these evaluates all settings; the row of the result is the setting.
  const Eigen::ArrayXXd& Rates();
  const Eigen::ArrayXXd& Outputs();
  // Each of these evaluates the first setting; its row of the result is 0.
  const Eigen::ArrayXXd& Arguments();
  const Eigen::ArrayXXd& Slopes();
  // Evaluates the right-hand side or the outputs with the modes that follow from the states alone.
  const Eigen::ArrayXXd& NaturalRates();
  const Eigen::ArrayXXd& NaturalOutputs();

 private:
  template <class Function>
  void Evaluate(Eigen::Index rows, Eigen::ArrayXXd& result, Function function);

  const SwitchingModel* model_;
  const StateSpaceModel* natural_;
  const Eigen::ArrayXXd* parameters_of_rows_;
  const BlockInputs* inputs_of_rows_;
  double time_s_ = 0;
  Eigen::Index used_ = 0;  // settings, rounded up to a multiple of kLanes
  Eigen::ArrayXXd modes_, states_, parameters_, inputs_;
  Eigen::ArrayXXd rates_, outputs_, arguments_, slopes_;
};

}  // namespace polyest::internal
