// Defines the project's reference scenario: a half car with a point mass of unknown size and
// position.

#include "client/paper/experiment_definitions.h"
#include "core/common/status.h"
#include "polyest/catalogue.h"

namespace polyest::internal::paper_experiments {

absl::StatusOr<Experiment> ReferenceScenario() {
  POLYEST_ASSIGN_OR_RETURN(auto model, FindBuiltinModel("roll_plane_4dof"));
  POLYEST_ASSIGN_OR_RETURN(auto mass, UncertainParameter::Beta("m_a", 2, 2, 50, 350));
  POLYEST_ASSIGN_OR_RETURN(auto place, UncertainParameter::Uniform("d", 0.2, 1.3));
  Problem problem;
  problem.model = std::move(model);
  problem.uncertain = {std::move(mass), std::move(place)};
  problem.inputs = {
      {"y1", HalfSineBumpInput{.amplitude = 0.05, .start_s = 0.5, .duration_s = 0.2}},
      {"y2", HalfSineBumpInput{.amplitude = 0.05, .start_s = 1.1, .duration_s = 0.2}}};
  for (const char* output : {"d1", "d2", "d1_rate", "d2_rate"}) {
    problem.measured.push_back({output, PaperNoise(1)});
  }

  Experiment experiment;
  experiment.figure = "reference";
  experiment.title = "a point mass on a half car";
  experiment.question =
      "What is the point mass m_a and how far from the left end does it sit, d, given travel and "
      "rate of travel of both suspensions over a bump on the left and a later one on the right? "
      "A priori m_a is beta(2, 2) on [50, 350] kg and d uniform on [0.2, 1.3] m.";
  experiment.says =
      "The scenario is the project's own, after the half car of the paper's second part, whose "
      "priors, road and noise are not at hand. Both parameters are identified; over many seeds of "
      "the noise each is within two standard deviations of the truth about 95 times in 100.";
  experiment.from_paper = false;
  experiment.reference = Vector(2);
  experiment.reference << 185, 0.48;
  experiment.cost_picture = CostPicture::kResponsesAndContours;
  ExperimentVariant variant{.name = "noise 1 %", .problem = problem, .sample_times_s = {}};
  for (int k = 1; k <= 500; ++k) variant.sample_times_s.push_back(k / 100.0);
  experiment.variants = {std::move(variant)};
  return experiment;
}

}  // namespace polyest::internal::paper_experiments
