#pragma once

// The experiments of section 3 of the paper (TR-07-38) and the project's reference scenario, as
// data: for each figure the problem, the synthetic measurements and what the paper says of it, and
// after a run what the estimator answers.
//
// Measurements are z_k = h(y_ref(t_k)) + ε_k, ε_k ~ N(0, R_k) (30), from the model at the reference
// values and a fixed seed. R_k is the channel's own noise model at the true value; the estimator,
// like the paper, takes R_k from z_k. The n-th value measured has the same ε/σ in every variant of
// an experiment, so that variants differ by what they are said to differ by and not by luck.

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/studies/cost_grid.h"
#include "polyest/estimate.h"
#include "polyest/samples.h"
#include "polyest/stop.h"

namespace polyest::internal {

// One way to put the question: what is measured, when and how well.
struct ExperimentVariant {
  std::string name;
  Problem problem;
  std::vector<double> sample_times_s;  // every measured output at each of them
  bool noise_free = false;             // ε = 0; the estimator's R_k stays as specified
};

// Says what is drawn of the cost.
enum class CostPicture {
  kCurves,                // mismatch, prior and total over one unknown, for each variant
  kContours,              // contours of the total over two unknowns, for each variant
  kContourParts,          // contours of mismatch, prior and total, for the first variant
  kResponsesAndContours,  // what is measured, and contours of mismatch and total, for the first
};

struct Experiment {
  std::string figure;  // "5"; the section where the paper has no figure; or "reference"
  std::string title;
  std::string question;    // what is asked, in a sentence or two
  std::string says;        // what the paper reports, or what is to be expected
  bool from_paper = true;  // false: the project's own
  Vector reference;        // the true values, in the order of `uncertain`
  std::vector<ExperimentVariant> variants;
  CostPicture cost_picture = CostPicture::kCurves;
};

// Outputs of the model over time at the reference values.
struct ReferenceResponse {
  std::vector<double> time_s;
  Matrix value;  // times × measured outputs
};

struct VariantResult {
  std::string name;
  Samples samples;
  ReferenceResponse response;  // what was to be measured, without noise
  Estimate estimate;
  Vector map_germ;      // ξ̂
  Vector std_dev_germ;  // stdDev in units of ξ
  CostGrid cost;        // axes in the parameters' units
};

struct ExperimentResult {
  Experiment experiment;
  Vector reference_germ;
  Prior prior;  // the same in all variants
  std::vector<VariantResult> variants;
};

// "Figure 5: …", "Section 3.5: …" or "Reference scenario: …".
std::string Heading(const Experiment& experiment);

// The figures there are, in the paper's order: "4" … "14", "3.5", "3.6"; then "reference".
std::vector<std::string> PaperFigures();

// INVALID_ARGUMENT, listing the figures there are, for one that is not among them.
absl::StatusOr<Experiment> MakeExperiment(std::string_view figure);

// The result is the same for any number of threads.
absl::StatusOr<ExperimentResult> RunExperiment(const Experiment& experiment, int threads,
                                               const Stop& stop = {});

// The outputs measured in `problem` at the given times and values of the uncertain parameters,
// from the model itself: times × measured outputs.
absl::StatusOr<Matrix> SimulateOutputs(const ResolvedProblem& problem, const Vector& theta,
                                       const std::vector<double>& time_s);

// The seed of every experiment's noise.
inline constexpr uint64_t kNoiseSeed = 2007;

// The measurements of a variant, from the model at `reference`.
absl::StatusOr<Samples> SyntheticSamples(const ExperimentVariant& variant, const Vector& reference,
                                         uint64_t seed = kNoiseSeed);

}  // namespace polyest::internal
