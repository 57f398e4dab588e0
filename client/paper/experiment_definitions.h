#pragma once

// The definitions behind MakeExperiment, one a figure. Private to this folder.

#include <absl/status/statusor.h>

#include "client/paper/experiments.h"

namespace polyest::internal::paper_experiments {

// Sections 3.1 and 3.2: a mass on a spring, struck at t = 0; its initial velocity is uncertain.
absl::StatusOr<Experiment> Figure4();
absl::StatusOr<Experiment> Figure5();
absl::StatusOr<Experiment> Figure6();
absl::StatusOr<Experiment> Figure7();
absl::StatusOr<Experiment> Figure8();
// Section 3.3: the same driven by a force of uncertain amplitude.
absl::StatusOr<Experiment> Figure11();
absl::StatusOr<Experiment> Figure12();
// Section 3.4: mass and stiffness from the frequency alone, and regularization.
absl::StatusOr<Experiment> Figure13();
absl::StatusOr<Experiment> Figure14();
// Section 3.5: a parameter that the measured output does not see.
absl::StatusOr<Experiment> Section35();
// Section 3.6: an excitation that is not rich enough.
absl::StatusOr<Experiment> Section36();
// The project's own: mass and place of a load on a half car.
absl::StatusOr<Experiment> ReferenceScenario();

// The noise of (30), as a standard deviation: `percent` of the value and a thousandth of the
// largest value so far. (The paper calls it a variance; its R_k is the square of this.)
NoiseModel PaperNoise(double percent);

// The paper's setting: the fixed expansion, 2 points a term; at order 5, 6 terms and 12 Halton
// points for one unknown. The integration is far finer than the least noise, 10⁻⁶, so that an
// output that is zero stays zero for the estimator as well.
Problem PaperProblem(std::shared_ptr<const Model> model, int order);

}  // namespace polyest::internal::paper_experiments
