#pragma once

// The states of an ensemble point by point (EnsembleState keeps them in blocks).

#include "core/common/types.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

// Returns whether all points are alive and their states are all that there is of them: no switch of
// the model has a mode of its own. Other states cannot be interpolated between points.
bool AreSmooth(const EnsembleState& ensemble);

// Returns the states of an ensemble of trajectories (not of filters), points × states.
Matrix StatesOf(const EnsembleState& ensemble);

// Returns the state of an ensemble of the same model over the same run, with other points in these
// states (points × states).
EnsembleState WithStates(const EnsembleState& ensemble, const ConstMatrixRef& states);

// Returns the Gaussians of an ensemble of filters of a model with n = `states` states (> 0),
// members × (n + n (n + 1)/2): the means, then the factors as GaussianStates keeps them.
Matrix GaussiansOf(const EnsembleState& filters, Eigen::Index states);

// Returns the state of an ensemble of filters of the same model over the same run, with other
// members that have these Gaussians (as GaussiansOf returns them).
EnsembleState WithGaussians(const EnsembleState& filters, Eigen::Index states,
                            const ConstMatrixRef& gaussians);

}  // namespace polyest::internal
