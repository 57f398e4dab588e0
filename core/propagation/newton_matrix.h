#pragma once

// Newton's matrices I − γ ∂f/∂x of a block of trajectories, one a point.

#include <Eigen/Core>

#include "core/propagation/block_lu.h"
#include "core/propagation/ensemble_integrator.h"
#include "core/propagation/error_scale.h"

namespace polyest {

class NewtonMatrix {
 public:
  explicit NewtonMatrix(EnsembleSystem* system);

  // ∂f/∂x at (time_s, states): exact where the system has it and it is finite, otherwise by forward
  // differences; `scale` says how large a state is.
  void Differentiate(double time_s, const Eigen::ArrayXXd& states, const ErrorScale& scale);
  void Factor(double gamma);
  void SolveInPlace(Eigen::ArrayXXd& x) { lu_.SolveInPlace(x); }

 private:
  void TakeDifferences(double time_s, const Eigen::ArrayXXd& states, const ErrorScale& scale);

  EnsembleSystem* system_;
  Eigen::ArrayXXd jacobian_;  // points × (states · states), column s·states + i is ∂f_i/∂x_s
  Eigen::ArrayXXd moved_, rates_, moved_rates_;
  BlockLu lu_;
};

}  // namespace polyest
