#pragma once

// The next experiment: how much its samples are expected to tell about the uncertain parameters
// (information_gain.h), by output, by sample time and, compared by the caller, by input.
//
// Slopes ∂y/∂ξ are those of the expansion over the prior, and its residual variance counts as
// noise, R_k = σ_k² + residual variance: an expansion that does not hold promises too little, not
// too much.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/common/stop.h"
#include "core/common/types.h"
#include "core/estimator/estimate.h"
#include "core/estimator/information_gain.h"
#include "core/estimator/problem.h"

namespace polyest {

struct ExperimentOptions {
  double until_s = 0;  // > 0
  double step_s = 0;   // > 0; samples may be taken at 0, step, 2 step … until
  int samples = 10;    // sample times to choose, 1 … kMostSampleTimes
  // Outputs that could be measured besides those of the problem; empty: all others of the model.
  // The noise of one without numbers is 1 % of the range of its predictions (assumed_noise.h); one
  // that is measured, or given before, has a noise already and must be without.
  std::vector<MeasuredOutput> possible;
  int threads = 1;

  absl::Status Validate() const;
};

inline constexpr int kMostSampleTimes = 1'000;

// Samples of one output at all times.
struct OutputGain {
  std::string output;
  std::string unit;
  double noise = 0;  // root mean square of σ over times and draws, without the expansion's error
  bool measured = false;  // by the problem
  InformationGain alone;
  InformationGain together;  // with all that the problem measures
};

struct SampleTime {
  double time_s = 0;
  InformationGain gain;  // of this and all chosen before it
};

struct ExperimentDesign {
  // Samples at all times of what the problem measures, or, if that is nothing, of all outputs.
  InformationGain gain;
  std::vector<OutputGain> outputs;  // the problem's channels first
  std::vector<SampleTime> samples;  // of the same outputs, in the order of their choice
  int order = 0;
  int terms = 0;
  int points = 0;
  // EXPANSION_INACCURATE when an output's residual is no longer small beside its noise;
  // POINTS_FAILED.
  std::vector<Diagnostic> diagnostics;
};

// What is known beforehand is the problem's prior; α² plays no part. INVALID_ARGUMENT names the
// field, the value and the rule; otherwise as PropagatePrior.
absl::StatusOr<ExperimentDesign> DesignExperiment(const ResolvedProblem& problem,
                                                  const ExperimentOptions& options,
                                                  const Stop& stop);

// The same problem with what an estimate says of its parameters for its prior: normal with the
// estimate's means and covariance, cut off at bounds of the old prior that are within five standard
// deviations. A channel whose noise the problem does not know gets the estimate's.
absl::StatusOr<ResolvedProblem> WithEstimateAsPrior(const ResolvedProblem& problem,
                                                    const Estimate& estimate);

}  // namespace polyest
