#pragma once

// Defines the experiments of MakeExperiment, one for each figure. Private to this folder.

#include <absl/status/statusor.h>

#include "client/paper/experiments.h"

namespace polyest::internal::paper_experiments {

// Sections 3.1 and 3.2: a mass on a spring, struck at t = 0; its initial velocity is uncertain.
absl::StatusOr<Experiment> Figure4();
absl::StatusOr<Experiment> Figure5();
absl::StatusOr<Experiment> Figure6();
absl::StatusOr<Experiment> Figure7();
absl::StatusOr<Experiment> Figure8();
// Section 3.3: a mass on a spring, driven by a force of uncertain amplitude.
absl::StatusOr<Experiment> Figure11();
absl::StatusOr<Experiment> Figure12();
// Section 3.4: mass and stiffness from the frequency alone, and regularization.
absl::StatusOr<Experiment> Figure13();
absl::StatusOr<Experiment> Figure14();
// Section 3.5: a parameter that does not affect the measured output.
absl::StatusOr<Experiment> Section35();
// Section 3.6: an excitation that is not rich enough.
absl::StatusOr<Experiment> Section36();
// The project's own experiment: mass and position of a load on a half car.
absl::StatusOr<Experiment> ReferenceScenario();

// Returns the noise of (30) as a standard deviation: `percent` of the value plus a thousandth of
// the largest value so far. (The paper calls it a variance; its R_k is the square of this.)
NoiseModel PaperNoise(double percent);

// Returns a problem with the paper's settings: an expansion of fixed order with 2 points per term;
// at order 5, one unknown has 6 terms and 12 Halton points. The relative tolerance of the
// integration, 10⁻¹¹, is far below the least noise, 10⁻⁶, so that an output that is zero is zero
// for the estimator, too.
Problem PaperProblem(std::shared_ptr<const Model> model, int order);

}  // namespace polyest::internal::paper_experiments
