#pragma once

// How a model's trajectories are integrated, and the description of one that fails.

#include <absl/status/status.h>

#include <string>

namespace polyest {

// The integrator.
enum class IntegrationMethod {
  // Steps by matrix exponentials for models that are linear in states and inputs
  // (StateSpaceModel::IsLinear), without error of integration; else explicit, and trajectories that
  // are stiff change to the stiff method for good.
  kAuto,
  kExplicit,  // Dormand–Prince, of order 5 or 8, whichever needs fewer evaluations
  kStiff,     // backward differentiation formulas of order 1 to 5
};

// Options of the integrator.
struct IntegrationOptions {
  IntegrationMethod method = IntegrationMethod::kAuto;  // which integrator
  // From 1e-13 to 0.01. The estimated local error of each state of each trajectory is at most
  // relative_tolerance × the largest magnitude of this state so far. That magnitude is the
  // trajectory's own, but at least a thousandth of the largest in its block of trajectories.
  // Nothing is absolute: states of 1e-14 are as accurate as states of 1. Exact steps do not use it.
  // The errors of the steps add up, so an estimator integrates up to eight more trajectories with a
  // tenth of the tolerance, but at least 1e-13. From the difference it tells how far the estimate
  // may be off, tightens the tolerance (Problem::tolerance_follows_noise) or says so
  // (DiagnosticCode::kExpansionInaccurate). It does not for models that simulate themselves (FMUs)
  // and for tolerances below 2e-13.
  double relative_tolerance = 1e-7;
  // Most steps from one sample to the next, ≥ 1; a trajectory that needs more has failed.
  int max_steps = 100'000;
  // ≥ 1. Each time this number of samples of a run has passed, the integrators start anew from the
  // states there, so that an estimator can be restored there (EstimatorOptions::snapshot). That
  // changes results, within the tolerance. An expansion that moves later takes its sums along from
  // there if they are accurate enough, which changes results by at most 0.005 of their standard
  // deviations.
  int samples_between_checkpoints = 4096;

  // Returns OK, or INVALID_ARGUMENT with the field, the value and the rule.
  absl::Status Validate() const;
};

// A trajectory that could not be integrated; it is left out from then on.
struct PointFailure {
  int point = 0;       // which collocation point, from 0
  double time_s = 0;   // the last time at which it was good
  int flag = 0;        // the solver's own return code
  std::string reason;  // that code in words
};

}  // namespace polyest
