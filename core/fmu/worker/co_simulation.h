#pragma once

// One trajectory of an FMU for Co-Simulation, which brings its own solver: from one communication
// point to the next,
//
//   t_0 = 0,  t_{k+1} = the earliest of the next multiple of the communication step, the next
//                       sample time and the next break of an input.
//
// An FMU holds its inputs over a step. They get the value in the middle of the step, with which the
// error of holding them is of second order in the step; one that interpolates its inputs gets the
// value and the slope of the straight line between both ends. At the sample times, outputs are
// those with the inputs of that time.

#include <memory>
#include <vector>

#include "core/fmu/worker/instance.h"
#include "core/fmu/worker/pointwise_ensemble.h"
#include "core/propagation/block_inputs.h"

namespace polyest::internal {

class CoSimulationPoint final : public PointTrajectory {
 public:
  CoSimulationPoint(const FmuInterface* interface, std::unique_ptr<Instance> instance,
                    BlockInputs inputs, int input_count, int output_count);

  bool AdvanceTo(double time_s) override;
  bool ReadOutputs(double* outputs) override;
  PointFailure failure() const override;

 private:
  double NextMultiple() const;
  bool Step(double to_s);
  bool SetInputs(double from_s, double to_s);
  Vector InputsAt(double time_s);

  const FmuInterface& interface_;
  std::unique_ptr<Instance> instance_;
  BlockInputs inputs_;
  const int input_count_;
  const int output_count_;
  double time_s_ = 0;
  double good_s_ = 0;  // the last time at which nothing was wrong
  std::string failure_;
};

}  // namespace polyest::internal
