#pragma once

// Newton's matrices I − γ ∂f/∂x of a block of trajectories, one for each point.

#include <Eigen/Core>

#include "core/propagation/block_integrator.h"
#include "core/propagation/block_lu.h"
#include "core/propagation/error_scale.h"

namespace polyest::internal {

class NewtonMatrix {
 public:
  explicit NewtonMatrix(BlockSystem* system);

  // Evaluates ∂f/∂x at (time_s, states): exactly if the system provides it and it is finite,
  // otherwise by forward differences, whose steps follow the magnitudes in `scale`.
  void Differentiate(double time_s, const Eigen::ArrayXXd& states, const ErrorScale& scale);
  void Factor(double gamma);
  void SolveInPlace(Eigen::ArrayXXd& x) { lu_.SolveInPlace(x); }

 private:
  void TakeDifferences(double time_s, const Eigen::ArrayXXd& states, const ErrorScale& scale);

  BlockSystem* system_;
  Eigen::ArrayXXd jacobian_;  // points × (states · states), column s·states + i is ∂f_i/∂x_s
  Eigen::ArrayXXd moved_, rates_, moved_rates_;
  BlockLu lu_;
};

}  // namespace polyest::internal
