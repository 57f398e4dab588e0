#pragma once

// What the SUNDIALS integrators of a block share: context, error norm, the vector of states, and
// the callbacks that a solver gets.

#include <sundials/sundials_context.h>
#include <sundials/sundials_nvector.h>

#include <Eigen/Core>
#include <memory>

#include "core/propagation/ensemble_integrator.h"
#include "core/propagation/ensemble_vector.h"
#include "core/propagation/error_scale.h"

namespace polyest {

struct VectorDestroyer {
  void operator()(N_Vector vector) const { N_VDestroy(vector); }
};
using OwnedVector = std::unique_ptr<_generic_N_Vector, VectorDestroyer>;

class SundialsBlock {
 public:
  SundialsBlock(EnsembleSystem* system, double relative_tolerance, double time_s,
                const ConstBlock& states);

  // Callbacks with `this` as user data.
  static int RightHandSide(double time_s, N_Vector states, N_Vector derivatives, void* block);
  static int ErrorWeights(N_Vector states, N_Vector weights, void* block);
  // The codes that solvers return say all; their messages on stderr are not wanted.
  static void IgnoreMessage(int, const char*, const char*, char*, void*) {}

  // A first step for the solver to try, (1/100) min_s S_s ÷ max_p |ẋ_ps|, at most span_s.
  double FirstStep(double span_s);

  Eigen::ArrayXXd& values() { return EnsembleValues(vector.get()); }

  EnsembleSystem* const system;
  sundials::Context context;
  ErrorScale scale;
  OwnedVector vector;  // the states at time_s
  double time_s;
};

}  // namespace polyest
