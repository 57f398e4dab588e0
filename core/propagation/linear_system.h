#pragma once

// Linear models as matrices, for steps without error of integration.
//
// A model with f(t, x, θ, u) = A x + B u + c, driven by inputs u_i = amplitude_i · shape_i +
// offset_i whose shapes solve linear systems themselves (input_generator.h), is the linear system
//
//   x' = A x + D w,   w' = J w,
//
// in which w stacks 1 (with the column Σ_i B_i offset_i + c of D) and the generators of the inputs
// that vary (with the column B_i amplitude_i for their first components, 0 for the others). A and D
// differ from point to point, J and w do not.

#include <Eigen/Core>
#include <vector>

#include "core/common/types.h"
#include "core/propagation/block_inputs.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

// The matrices of a block of points. Values of a point are in its row.
struct LinearSystem {
  // The components of w that belong to an input.
  struct Generator {
    size_t input = 0;
    Eigen::Index first = 0, size = 0;
  };

  Eigen::Index states = 0;
  Eigen::Index components = 0;   // of w; the first is 1
  Eigen::ArrayXXd coefficients;  // rows × states · (states + components): column c·states + i is
                                 // element i, c of [A D]
  Matrix J;                      // components × components, in 1/s
  double rate = 0;               // bound on the rates of change of A and J over the block, in 1/s
  std::vector<Generator> generators;
};

// Whether ensembles of the specification step exactly: the method is kAuto; the model has from 1 to
// kMaxExactStates states and is linear for these parameters (StateSpaceModel::IsLinear); every
// input is constant or solves a linear system, with the same delay for all points; and every
// coefficient is finite.
bool StepsExactly(const EnsembleSpecification& specification, const InputSignals& inputs);
// Beyond it the matrices cost more time and memory than integration.
inline constexpr Eigen::Index kMaxExactStates = 24;

// Returns the matrices of a model that is linear for these parameters and inputs.
LinearSystem LinearSystemOf(const StateSpaceModel& model, const Eigen::ArrayXXd& parameters,
                            const InputSignals& signals, const BlockInputs& inputs);

}  // namespace polyest::internal
