#pragma once

// Finds the first step of an integrator and the floors of its error scale (error_scale.h) from the
// size of the derivatives.

#include <Eigen/Core>

#include "core/propagation/block_integrator.h"
#include "core/propagation/error_scale.h"

namespace polyest::internal {

class ErrorFloors {
 public:
  // Both must outlive the object.
  ErrorFloors(BlockSystem* system, ErrorScale* scale);

  // Returns a first step, (1/100) min_s S_s ÷ max_p |ẋ_ps|, limited to a small part of `span_s` so
  // that an input that is 0 now is not stepped over. It is a guess: the error test shortens it, and
  // it may grow fast.
  double FirstStep(double time_s, const Eigen::ArrayXXd& states, double span_s);
  // Gives the scale its floors, for steps of about `step_s` until a sample in `span_s`, if it needs
  // new ones.
  void Update(double time_s, const Eigen::ArrayXXd& states, double step_s, double span_s);

 private:
  // Returns the size that each state which is 0 will have reached after `span_s`, nearly: the rates
  // on the way, with the other states as large as they are now or will be.
  Vector ExpectedSizes(double time_s, const Eigen::ArrayXXd& states, double span_s);

  BlockSystem* const system_;
  ErrorScale* const scale_;
  Eigen::ArrayXXd first_rates_, moved_states_, moved_rates_;
  double step_s_ = 0;  // for which the floors were set
};

}  // namespace polyest::internal
