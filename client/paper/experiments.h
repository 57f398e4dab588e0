#pragma once

// Defines and runs the experiments of section 3 of the paper (TR-07-38) and the project's reference
// scenario: for each figure the problem, the synthetic measurements, the paper's result and, after
// a run, the estimate.
//
// Measurements are z_k = h(y_ref(t_k)) + ε_k, ε_k ~ N(0, R_k) (30), from the model at the reference
// values and a fixed seed. R_k is the channel's own noise model at the true value; the estimator,
// like the paper, takes R_k from z_k. The n-th measured value has the same ε/σ in every variant of
// an experiment, so that differences between variants are not due to different random draws.

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

// One variant of an experiment: its outputs, sample times and noise.
struct ExperimentVariant {
  std::string name;
  Problem problem;
  std::vector<double> sample_times_s;  // all measured outputs are sampled at each time
  bool noise_free = false;             // ε = 0; the estimator's R_k stays as specified
};

// Selects the plots of the cost.
enum class CostPicture {
  kCurves,                // mismatch, prior and total over one unknown, for each variant
  kContours,              // contours of the total over two unknowns, for each variant
  kContourParts,          // contours of mismatch, prior and total, for the first variant
  kResponsesAndContours,  // measured outputs, contours of mismatch and total, for the first variant
};

struct Experiment {
  std::string figure;  // "5"; the section where the paper has no figure; or "reference"
  std::string title;
  std::string question;    // the question to be answered, in a sentence or two
  std::string says;        // the result that the paper reports, or the expected result
  bool from_paper = true;  // false: the project's own experiment
  Vector reference;        // the true values, in the order of `uncertain`
  std::vector<ExperimentVariant> variants;
  CostPicture cost_picture = CostPicture::kCurves;
};

// Outputs of the model over time at the reference values of the parameters.
struct ReferenceResponse {
  std::vector<double> time_s;
  Matrix value;  // times × measured outputs
};

struct VariantResult {
  std::string name;
  Samples samples;
  ReferenceResponse response;  // the measured outputs without noise
  Estimate estimate;
  Vector map_germ;      // ξ̂
  Vector std_dev_germ;  // standard deviation in units of ξ
  CostGrid cost;        // axes in the parameters' units
};

struct ExperimentResult {
  Experiment experiment;
  Vector reference_germ;
  Prior prior;  // the same in all variants
  std::vector<VariantResult> variants;
};

// Returns "Figure 5: …", "Section 3.5: …" or "Reference scenario: …".
std::string Heading(const Experiment& experiment);

// Returns the names of all figures in the paper's order: "4" … "14", "3.5", "3.6"; then
// "reference".
std::vector<std::string> PaperFigures();

// Returns the experiment of a figure. Refuses an unknown figure with INVALID_ARGUMENT, listing the
// known ones.
absl::StatusOr<Experiment> MakeExperiment(std::string_view figure);

// Simulates the measurements of all variants and estimates from them. The result is the same for
// any number of threads.
absl::StatusOr<ExperimentResult> RunExperiment(const Experiment& experiment, int threads,
                                               const Stop& stop = {});

// Simulates the model at the given values of the uncertain parameters. Returns the outputs measured
// in `problem` at the given times, times × measured outputs.
absl::StatusOr<Matrix> SimulateOutputs(const ResolvedProblem& problem, const Vector& theta,
                                       const std::vector<double>& time_s);

// The seed of every experiment's noise.
inline constexpr uint64_t kNoiseSeed = 2007;

// Returns the measurements of a variant, simulated at the parameter values `reference`.
absl::StatusOr<Samples> SyntheticSamples(const ExperimentVariant& variant, const Vector& reference,
                                         uint64_t seed = kNoiseSeed);

}  // namespace polyest::internal
