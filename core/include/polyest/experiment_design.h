#pragma once

// The next experiment: how much its samples are expected to tell about the uncertain parameters,
// for each output and sample time. To compare inputs, call it once for each.
//
// With samples y_k + noise of variance R_k, and a_k = ∂y_k/∂ξ in units of the prior's standard
// deviations and of √R_k, the precision after the experiment is M = Id + Σ_k a_k a_kᵀ in units of
// the prior's, and the information gained is ½ log₂ det M bits: one bit halves the standard
// deviation in one direction. Expected values are means over draws of the truth from the prior
// (K. Chaloner and I. Verdinelli, "Bayesian experimental design: a review", Statist. Sci. 10,
// 1995). Slopes are the model's own at each draw, by central differences: those of an expansion
// over a wide prior would tell parameters apart that the model cannot.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "polyest/diagnostic.h"
#include "polyest/estimate.h"
#include "polyest/problem.h"
#include "polyest/stop.h"
#include "polyest/types.h"

namespace polyest {

// The most sample times that can be chosen.
inline constexpr int kMaxSampleTimes = 1'000;

// What to compute.
struct ExperimentOptions {
  double until_s = 0;  // > 0: the last possible time
  double step_s = 0;   // > 0; samples may be taken at 0, step, 2 step … until
  int samples = 10;    // sample times to choose, 1 … kMaxSampleTimes
  // Outputs that could be measured besides those of the problem; empty: all others of the model.
  // The noise of an output without numbers is 1 % of the range of its predictions. An output that
  // the problem measures, or that is in this list already, must have no numbers.
  std::vector<MeasuredOutput> possible;
  int threads = 1;  // ≥ 1; results do not depend on it

  // Returns OK, or INVALID_ARGUMENT with the field, the value and the rule.
  absl::Status Validate() const;
};

// What samples are expected to tell.
struct InformationGain {
  double bits = 0;  // ≥ 0
  Vector std_dev;   // expected afterwards, of each uncertain parameter in its unit
};

// What samples of one output at all times are expected to tell.
struct OutputGain {
  std::string output;        // its name
  std::string unit;          // "1" for a plain number; empty: the equations give none
  double noise = 0;          // root mean square of σ over times and draws, in the output's unit
  bool measured = false;     // whether the problem measures it
  InformationGain alone;     // by this output alone
  InformationGain together;  // with all that the problem measures
};

// A chosen sample time.
struct SampleTime {
  double time_s = 0;     // when to take a sample
  InformationGain gain;  // by this time and all chosen before it
};

// What an experiment is expected to tell.
struct ExperimentDesign {
  // By samples at all times of what the problem measures, or of all outputs if it measures none.
  InformationGain gain;
  std::vector<OutputGain> outputs;  // the measured ones first
  std::vector<SampleTime> samples;  // of the same outputs, in the order of their choice
  int draws = 0;                    // of the true value, over which gains are averaged
  int trajectories = 0;             // integrated for the slopes
  // kPointsFailed where a trajectory could not be integrated; its draw is left out.
  std::vector<Diagnostic> diagnostics;
};

// Computes what an experiment is expected to tell. What is known beforehand is the problem's prior,
// whatever α² is. INVALID_ARGUMENT names the field, the value and the rule; otherwise as
// PropagatePrior.
absl::StatusOr<ExperimentDesign> DesignExperiment(const Problem& problem,
                                                  const ExperimentOptions& options,
                                                  const Stop& stop = {});

// Returns the problem with an estimate of its parameters as the prior: normal, with the estimate's
// means and covariance, cut off at bounds of the old prior that are within five standard
// deviations. An output whose noise is unknown gets the estimated noise. INVALID_ARGUMENT if the
// problem cannot be used, has a likelihood of prediction errors, or the estimate is not an estimate
// of it.
absl::StatusOr<Problem> WithEstimateAsPrior(const Problem& problem, const Estimate& estimate);

}  // namespace polyest
