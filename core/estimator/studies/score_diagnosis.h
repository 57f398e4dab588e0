#pragma once

// What score tests add to an estimate.

#include "core/estimator/studies/score_tests.h"
#include "polyest/estimate.h"

namespace polyest::internal {

// Whether tests can tell something of an estimate: its expansion follows the model, and it is at a
// minimum inside of the prior, of which there are no others.
bool IsWorthTesting(const Estimate& estimate);

// Puts FIXED_VALUE_CONFLICT before the other diagnostics of the estimate, for the quantity with the
// largest score s, if all of this holds. |s| ÷ √dispersion is kMinScore at least, with the
// dispersion of the residuals that the correction leaves. It lets χ² fall by half of s² at least,
// so that the model is near enough to linear. And either residuals contradict the noise, for which
// the quantity is then a reason, or it moves a parameter by one standard deviation or more. Such
// parameters are then kWeak at most.
void AddScoreTests(const FixedValueTests& tests, Estimate& estimate);

}  // namespace polyest::internal
