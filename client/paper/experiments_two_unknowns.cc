// Defines figures 13 and 14 and sections 3.5 and 3.6: parameters that cannot be identified, and
// remedies.

#include <absl/strings/str_cat.h>

#include <cmath>
#include <numbers>

#include "client/paper/experiment_definitions.h"
#include "core/common/status.h"
#include "polyest/catalogue.h"

namespace polyest::internal::paper_experiments {
namespace {

// The noise of section 3.4, 0.01 √(K0/M0), and the number that the paper prints for it.
constexpr double kFrequencyNoise = 0.0628;  // rad/s
constexpr double kPrintedFrequencyNoise = 0.3938;

const char* const kValleyQuestion =
    "What are mass and stiffness, given the natural frequency ω = √(k/m) measured once? "
    "A priori m is normal(200, 6.667) kg and k normal(7895.68, 1052.8) N/m.";

ExperimentVariant FrequencyVariant(const Problem& problem, double rho, double alpha_squared) {
  ExperimentVariant variant;
  variant.name = absl::StrCat("ρ = ", rho, ", α² = ", alpha_squared);
  variant.problem = problem;
  variant.problem.measured = {{"omega", NoiseModel{.absolute = rho}}};
  variant.problem.regularization = alpha_squared;
  variant.sample_times_s = {1};
  variant.noise_free = true;
  return variant;
}

absl::StatusOr<Problem> FrequencyProblem() {
  POLYEST_ASSIGN_OR_RETURN(auto model, FindBuiltinModel("mass_spring_frequency"));
  // √ is smooth over the priors (ω² > 0 up to 7 standard deviations of k), so that order 5
  // approximates it to a thousandth of ρ. The lowest point of a valley needs that accuracy.
  Problem problem = PaperProblem(std::move(model), 5);
  const double k0 = 200 * 4 * std::numbers::pi * std::numbers::pi;
  POLYEST_ASSIGN_OR_RETURN(auto m, UncertainParameter::Normal("m", 200, 6.667));
  POLYEST_ASSIGN_OR_RETURN(auto k, UncertainParameter::Normal("k", k0, 1052.8));
  problem.uncertain = {std::move(m), std::move(k)};
  return problem;
}

// Returns the reference values, at ξ_ref = (0.23, −0.38).
Vector FrequencyReference(const Problem& problem) {
  Vector reference(2);
  reference << problem.uncertain[0].location + 0.23 * problem.uncertain[0].scale,
      problem.uncertain[1].location - 0.38 * problem.uncertain[1].scale;
  return reference;
}

std::vector<double> Times(double step_s, double until_s) {
  std::vector<double> times_s;
  const int count = static_cast<int>(std::lround(until_s / step_s));
  for (int k = 1; k <= count; ++k) times_s.push_back(step_s * k);
  return times_s;
}

}  // namespace

absl::StatusOr<Experiment> Figure13() {
  POLYEST_ASSIGN_OR_RETURN(Problem problem, FrequencyProblem());
  Experiment experiment;
  experiment.figure = "13";
  experiment.title = "Contours of the cost: mismatch, prior, total";
  experiment.question = kValleyQuestion;
  experiment.says =
      "The mismatch has a line of minima, all pairs (k, m) of the same ratio: m and k are not "
      "identifiable. With the prior, ξ = (0.09, −0.40). (0.01 √(K0/M0) is 0.0628 rad/s; the paper "
      "prints 0.3938, from which (0.055, −0.227) would follow.)";
  experiment.reference = FrequencyReference(problem);
  experiment.cost_picture = CostPicture::kContourParts;
  experiment.variants = {FrequencyVariant(problem, kFrequencyNoise, 1),
                         FrequencyVariant(problem, kPrintedFrequencyNoise, 1)};
  return experiment;
}

absl::StatusOr<Experiment> Figure14() {
  POLYEST_ASSIGN_OR_RETURN(Problem problem, FrequencyProblem());
  Experiment experiment;
  experiment.figure = "14";
  experiment.title = "Contours of the cost after regularization";
  experiment.question = kValleyQuestion;
  experiment.says =
      "With a low α² the cost looks like its mismatch, with a high one like the prior; between, "
      "the "
      "valley becomes an ellipse that moves to (0, 0). The paper settles on ξ = (0.09, −0.40). "
      "(It names α² = 5·10⁶ for it, where (56) gives the prior mode; α² = 1 gives its ξ.)";
  experiment.reference = FrequencyReference(problem);
  experiment.cost_picture = CostPicture::kContours;
  for (double alpha_squared : {1e-4, 1.0, 10.0, 100.0, 1000.0}) {
    experiment.variants.push_back(FrequencyVariant(problem, kFrequencyNoise, alpha_squared));
  }
  for (const auto& [rule, name] : {std::pair{RegularizationMode::kDiscrepancy, "discrepancy"},
                                   {RegularizationMode::kEvidence, "evidence"},
                                   {RegularizationMode::kLCurve, "L-curve"}}) {
    ExperimentVariant chosen = FrequencyVariant(problem, kFrequencyNoise, 1);
    chosen.name = absl::StrCat("ρ = ", kFrequencyNoise, ", α² by ", name);
    chosen.problem.regularization_mode = rule;
    experiment.variants.push_back(std::move(chosen));
  }
  return experiment;
}

absl::StatusOr<Experiment> Section35() {
  POLYEST_ASSIGN_OR_RETURN(auto model, FindBuiltinModel("linear_two_state"));
  Problem problem = PaperProblem(std::move(model), 5);
  // The paper names neither prior nor inputs; these are the project's.
  POLYEST_ASSIGN_OR_RETURN(auto theta, UncertainParameter::Normal("theta", 1, 0.5));
  problem.uncertain = {std::move(theta)};
  problem.inputs = {{"u1", StepInput{.amplitude = 1, .time_s = 0}},
                    {"u2", SinusoidInput{.amplitude = 1, .frequency_hz = 0.5}}};
  Experiment experiment;
  experiment.figure = "3.5";
  experiment.title = "Non-observability";
  experiment.question =
      "What is θ of (57), given x1 − x2, and given x1 as well? A priori θ is normal(1, 0.5).";
  experiment.says =
      "x1 − x2 does not depend on θ: the mismatch is constant and the estimate the prior's most "
      "likely value. Measuring another state puts it right.";
  experiment.reference = Vector::Constant(1, 1.3);
  problem.measured = {{"x1_minus_x2", PaperNoise(1)}};
  experiment.variants.push_back(
      {.name = "x1 − x2 measured", .problem = problem, .sample_times_s = Times(0.25, 5)});
  problem.measured.push_back({"x1", PaperNoise(1)});
  experiment.variants.push_back(
      {.name = "x1 − x2 and x1 measured", .problem = problem, .sample_times_s = Times(0.25, 5)});
  return experiment;
}

absl::StatusOr<Experiment> Section36() {
  POLYEST_ASSIGN_OR_RETURN(auto model, FindBuiltinModel("roll_plane_2dof"));
  Problem problem = PaperProblem(std::move(model), 5);
  // Priors and excitation are the project's: a road bump 0.05 m high, under both sides at the same
  // time in the first variant and under the left side in the second.
  POLYEST_ASSIGN_OR_RETURN(auto mass, UncertainParameter::Beta("M", 2, 2, 500, 700));
  POLYEST_ASSIGN_OR_RETURN(auto inertia, UncertainParameter::Beta("I", 2, 2, 55, 80));
  problem.uncertain = {std::move(mass), std::move(inertia)};
  const HalfSineBumpInput bump{.amplitude = 0.05, .start_s = 0.1, .duration_s = 0.2};
  Experiment experiment;
  experiment.figure = "3.6";
  experiment.title = "Choice of excitation";
  experiment.question =
      "What are mass M and roll inertia I of the bar (58), given x1 and x2? A priori M is "
      "beta(2, 2) on [500, 700] kg and I beta(2, 2) on [55, 80] kg m².";
  experiment.says =
      "With the same excitation left and right x1 = x2 for ever and the output does not depend on "
      "I; a different one on each side identifies it.";
  experiment.reference = Vector(2);
  experiment.reference << 580, 63.3316;
  experiment.cost_picture = CostPicture::kContours;
  problem.measured = {{"x1", PaperNoise(1)}, {"x2", PaperNoise(1)}};
  problem.inputs = {{"u1", bump}, {"u2", bump}};
  experiment.variants.push_back(
      {.name = "u1 = u2", .problem = problem, .sample_times_s = Times(0.02, 1)});
  problem.inputs = {{"u1", bump}};
  experiment.variants.push_back(
      {.name = "u1 ≠ u2", .problem = problem, .sample_times_s = Times(0.02, 1)});
  return experiment;
}

NoiseModel PaperNoise(double percent) {
  return {.relative = percent / 100, .relative_to_max = 0.001, .least = 1e-6};
}

Problem PaperProblem(std::shared_ptr<const Model> model, int order) {
  Problem problem;
  problem.model = std::move(model);
  problem.expansion = {
      .order = order, .points_per_term = 2, .points = PointSet::kHalton, .adaptive = false};
  problem.integration.relative_tolerance = 1e-11;
  return problem;
}

}  // namespace polyest::internal::paper_experiments
