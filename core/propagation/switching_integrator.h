#pragma once

// The integrator of models whose equations switch (core/model/switching_model.h). It locates each
// point's own switchings, so that every step is smooth, and lets a point slide along a surface as
// switched_rows.h describes.
//
// Each row takes steps of its own with the method of Dormand and Prince. In a step the modes are
// frozen. Where an argument has then left its piece, the step is taken again up to the time at
// which it leaves, which is found by the secant method, and the modes are decided anew there.

#include <memory>

#include "core/model/switching_model.h"
#include "core/propagation/block_inputs.h"
#include "core/propagation/block_integrator.h"

namespace polyest::internal {

// Starts the integrator at `states` with `modes` (rows × switches): each switch's mode, halfway
// between its two modes if it slides, or NaN if it follows from the states. The integrator writes
// the modes of the states that it returns to `modes`. All that is pointed to must outlive it.
std::unique_ptr<BlockIntegrator> MakeSwitchingIntegrator(
    const SwitchingModel* model, const Eigen::ArrayXXd* parameters, const BlockInputs* inputs,
    double relative_tolerance, double time_s, const ConstBlock& states, Eigen::ArrayXXd* modes);

}  // namespace polyest::internal
