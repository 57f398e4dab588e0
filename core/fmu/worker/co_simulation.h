#pragma once

// One trajectory of an FMU for Co-Simulation, which contains its own solver. It advances from one
// communication point to the next,
//
//   t_0 = 0,  t_{k+1} = the earliest of the next multiple of the communication step, the next
//                       sample time and the next break of an input.
//
// If the FMU cannot vary its communication step, breaks are not communication points, and a sample
// time that is no multiple of the step fails the trajectory.
//
// An FMU holds its inputs during a step. It is given their values at the middle of the step, which
// makes the error of holding them second order in the step. An FMU that interpolates its inputs is
// given the value and the slope of the straight line between both ends. The outputs at a sample
// time are those with the inputs at that time.

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
  double good_s_ = 0;  // the last time before the failure
  std::string failure_;
};

}  // namespace polyest::internal
