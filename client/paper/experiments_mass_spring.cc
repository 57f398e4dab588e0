// Defines figures 4 to 12: one unknown amplitude, with the reference value ξ = 0.23.

#include <absl/strings/str_cat.h>

#include <numbers>

#include "client/paper/experiment_definitions.h"
#include "core/common/status.h"
#include "polyest/catalogue.h"

namespace polyest::internal::paper_experiments {
namespace {

constexpr double kReferenceGerm = 0.23;
constexpr int kOrder = 5;  // 6 terms
constexpr double kUntil = 5;

const char* const kVelocityQuestion =
    "What was the initial velocity v0 of the mass, given x at the times measured? "
    "A priori v0 is beta(2, 2) on [0.5, 1.5] m/s.";
const char* const kForceQuestion =
    "What is the amplitude F0 of the force, given x and v at the times measured? "
    "A priori F0 is beta(2, 2) on [500, 1500] N.";

// Section 3.1: m = 0.1 kg, k = 0.1 (2π)² N/m, so that x(t) = v0/(2π) sin 2πt (28).
absl::StatusOr<Problem> StruckMass() {
  POLYEST_ASSIGN_OR_RETURN(auto model, FindBuiltinModel("mass_spring_damper"));
  Problem problem = PaperProblem(std::move(model), kOrder);
  problem.fixed = {
      {"m", 0.1}, {"c", 0.0}, {"k", 0.1 * 4 * std::numbers::pi * std::numbers::pi}, {"x0", 0.0}};
  POLYEST_ASSIGN_OR_RETURN(auto v0, UncertainParameter::Beta("v0", 2, 2, 0.5, 1.5));
  problem.uncertain = {std::move(v0)};
  return problem;
}

// Section 3.3: m = 200 kg, natural frequency 1.5 Hz, F0 cos πt from rest, so that
// x(t) = 1.2665·10⁻⁴ F0 sin πt sin 2πt (52).
absl::StatusOr<Problem> ForcedMass() {
  POLYEST_ASSIGN_OR_RETURN(auto model, FindBuiltinModel("mass_spring_damper"));
  Problem problem = PaperProblem(std::move(model), kOrder);
  problem.fixed = {{"m", 200.0},
                   {"c", 0.0},
                   {"k", 200 * 9 * std::numbers::pi * std::numbers::pi},
                   {"x0", 0.0},
                   {"v0", 0.0}};
  POLYEST_ASSIGN_OR_RETURN(auto force,
                           UncertainParameter::Beta("force.amplitude", 2, 2, 500, 1500));
  problem.uncertain = {std::move(force)};
  problem.inputs = {
      {"force",
       SinusoidInput{.amplitude = 1000, .frequency_hz = 0.5, .phase_rad = std::numbers::pi / 2}}};
  return problem;
}

// The measurements of one figure, and the result that the paper reports.
struct Definition {
  const char* figure;
  const char* title;
  const char* question;
  const char* says;
  std::vector<std::string> outputs;
  std::vector<double> times_s;
  std::vector<double> noise_percents;  // one variant for each
};

absl::StatusOr<Experiment> Define(absl::StatusOr<Problem> problem, const Definition& definition) {
  POLYEST_RETURN_IF_ERROR(problem.status());
  Experiment experiment;
  experiment.figure = definition.figure;
  experiment.title = definition.title;
  experiment.question = definition.question;
  experiment.says = definition.says;
  const UncertainParameter& unknown = problem->uncertain.front();
  experiment.reference = Vector::Constant(1, unknown.location + unknown.scale * kReferenceGerm);
  for (double percent : definition.noise_percents) {
    problem->measured.clear();
    for (const std::string& output : definition.outputs) {
      problem->measured.push_back({output, PaperNoise(percent)});
    }
    experiment.variants.push_back({.name = absl::StrCat("noise ", percent, " %"),
                                   .problem = *problem,
                                   .sample_times_s = definition.times_s});
  }
  return experiment;
}

// Returns `count` evenly spaced times, of which the last is 5 s.
std::vector<double> EvenTimes(int count) {
  std::vector<double> times_s;
  for (int k = 1; k <= count; ++k) times_s.push_back(kUntil * k / count);
  return times_s;
}

}  // namespace

absl::StatusOr<Experiment> Figure4() {
  return Define(
      StruckMass(),
      {.figure = "4",
       .title = "Estimation with 10 time points, all at zero crossings",
       .question = kVelocityQuestion,
       .says = "The mismatch is constant: sampled at 0.5, 1.0 … 5.0 s the displacement is zero "
               "whatever v0 is. The estimate is the best initial guess, ξ = 0: the worst case of "
               "undersampling.",
       .outputs = {"x"},
       .times_s = EvenTimes(10),
       .noise_percents = {1}});
}

absl::StatusOr<Experiment> Figure5() {
  return Define(
      StruckMass(),
      {.figure = "5",
       .title = "Estimation with 3 time points",
       .question = kVelocityQuestion,
       .says = "A sharp minimum and an accurate estimate for little noise, though sampled below "
               "the Nyquist rate; at 10 % the prior weighs more and the minimum is wide.",
       .outputs = {"x"},
       .times_s = {1.1, 2.7, 4.3},
       .noise_percents = {0.01, 1, 10}});
}

absl::StatusOr<Experiment> Figure6() {
  return Define(StruckMass(),
                {.figure = "6",
                 .title = "Estimation with 30 time points",
                 .question = kVelocityQuestion,
                 .says = "More samples average the noise out: the mismatch weighs more and the "
                         "estimate at 10 % is better than with 3.",
                 .outputs = {"x"},
                 .times_s = EvenTimes(30),
                 .noise_percents = {0.01, 1, 10}});
}

absl::StatusOr<Experiment> Figure7() {
  POLYEST_ASSIGN_OR_RETURN(
      Experiment experiment,
      Define(StruckMass(),
             {.figure = "7",
              .title = "Adding samples that contain no information",
              .question = kVelocityQuestion,
              .says = "The extra samples add a constant to the mismatch, the effect of their "
                      "noise; the minimum is not more pronounced and the estimate no better.",
              .outputs = {"x"},
              .times_s = {0.3, 0.8, 1.2, 1.7, 2.3},
              .noise_percents = {0.01}}));
  // The zero crossings come after the informative times, so that these have the same noise draws
  // and the same largest value so far in both variants.
  experiment.variants.push_back(experiment.variants.front());
  experiment.variants[0].name = "5 times, noise 0.01 %";
  experiment.variants[1].name = "and 5 zero crossings";
  for (double time_s : {3.0, 3.5, 4.0, 4.5, 5.0}) {
    experiment.variants[1].sample_times_s.push_back(time_s);
  }
  return experiment;
}

absl::StatusOr<Experiment> Figure8() {
  return Define(
      StruckMass(),
      {.figure = "8",
       .title = "Estimation with 1 time point, displacement and velocity measured",
       .question = "What was the initial velocity v0 of the mass, given x and v at a single time? "
                   "A priori v0 is beta(2, 2) on [0.5, 1.5] m/s.",
       .says = "One time is sufficient for low noise: x and v are never both zero.",
       .outputs = {"x", "v"},
       .times_s = {3.3},
       .noise_percents = {0.01, 1}});
}

absl::StatusOr<Experiment> Figure11() {
  return Define(ForcedMass(),
                {.figure = "11",
                 .title = "Forced mass, 5 time points without information",
                 .question = kForceQuestion,
                 .says = "At 1, 2 … 5 s displacement and velocity are both zero whatever F0 is: "
                         "the estimate is the prior's most likely value, 1000 N, at any noise.",
                 .outputs = {"x", "v"},
                 .times_s = EvenTimes(5),
                 .noise_percents = {0.01, 10}});
}

absl::StatusOr<Experiment> Figure12() {
  return Define(ForcedMass(),
                {.figure = "12",
                 .title = "Forced mass, 3 time points",
                 .question = kForceQuestion,
                 .says = "Three times yield an accurate estimate at low noise, well below the "
                         "Nyquist rate; the shape of the cost tells that it is accurate.",
                 .outputs = {"x", "v"},
                 .times_s = {0.75, 2.3, 4.2},
                 .noise_percents = {0.01, 10}});
}

}  // namespace polyest::internal::paper_experiments
