#include "tests/testing/two_gliders.h"

namespace polyest::internal::testing {

ModelDescription TwoGliders::Describe() {
  ModelDescription description;
  description.name = "two_gliders";
  description.summary = "Two gliders between three springs";
  description.states = {{"x1", "1", "first displacement, pixels"},
                        {"x2", "1", "second displacement, pixels"},
                        {"v1", "1/s", "first velocity"},
                        {"v2", "1/s", "second velocity"}};
  for (const char* name :
       {"a", "b", "g", "h", "c1", "c2", "o1", "o2", "x1_0", "x2_0", "v1_0", "v2_0"}) {
    description.parameters.push_back({name, "1", "see the equations"});
  }
  description.outputs = {{"x1", "1", "first displacement"}, {"x2", "1", "second displacement"}};
  return description;
}

Problem TwoGlidersProblem(int order) {
  Problem problem;
  problem.model = std::make_shared<LaneModel<TwoGliders>>();
  const auto uniform = [&](const char* name, double lower, double upper) {
    problem.uncertain.push_back(*UncertainParameter::Uniform(name, lower, upper));
  };
  uniform("a", 2, 15);
  uniform("b", 40, 120);
  uniform("g", 15, 50);
  uniform("h", 1, 6);
  uniform("c1", 0, 0.3);
  uniform("c2", 0, 0.3);
  uniform("o1", 20, 100);
  uniform("o2", -100, -20);
  uniform("x1_0", -20, 20);
  uniform("x2_0", -160, -120);
  uniform("v1_0", -300, 300);
  uniform("v2_0", -300, 300);
  problem.measured = {{"x1", {.absolute = 0.62}}, {"x2", {.absolute = 0.62}}};
  problem.expansion.order = order;
  return problem;
}

}  // namespace polyest::internal::testing
