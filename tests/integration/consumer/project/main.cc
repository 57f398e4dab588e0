// A user's program: lists the built-in models, then estimates the stiffness of a spring from the
// free oscillation x = cos(√(k/m) t) of a mass on it, with a built-in model and with equations as
// text, and the deceleration of a mass with a model of its own. Exit status 0 when all are right.

#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include "own_model.h"
#include "polyest/catalogue.h"
#include "polyest/equation_model.h"
#include "polyest/estimator.h"
#include "polyest/prior_propagation.h"

namespace {

constexpr double kMassKg = 1;
constexpr double kStiffnessNPerM = 40;
constexpr double kDecelerationMPerS2 = 3;
constexpr double kFirstSpeedMPerS = 20;

double FreeOscillation(double time_s) {
  return std::cos(std::sqrt(kStiffnessNPerM / kMassKg) * time_s);
}
double BrakingDistance(double time_s) {
  return (kFirstSpeedMPerS - kDecelerationMPerS2 * time_s / 2) * time_s;
}

polyest::Samples Sampled(const std::function<double(double)>& x) {
  polyest::Samples samples;
  polyest::SampleColumn column{.name = "x", .value = {}, .missing = {}};
  for (int k = 1; k <= 40; ++k) {
    samples.time_s.push_back(0.05 * k);
    column.value.push_back(x(0.05 * k));
  }
  samples.columns.push_back(column);
  return samples;
}

polyest::Problem Spring(std::shared_ptr<const polyest::Model> model, const std::string& position) {
  polyest::Problem problem;
  problem.model = std::move(model);
  problem.fixed = {{"m", kMassKg}, {position, 1.0}};
  problem.uncertain = {polyest::UncertainParameter::Uniform("k", 30, 50).value()};
  problem.measured = {{.output = "x", .noise = {.absolute = 0.01}}};
  return problem;
}

polyest::Problem SpringAsText() {
  polyest::EquationSpecification equations;
  equations.states = {{"x", "v"}, {"v", "-k*x/m"}};
  equations.outputs = {{"x", "x"}};
  return Spring(polyest::MakeEquationModel(equations).value(), "x_0");
}

polyest::Problem Braking() {
  polyest::Problem problem;
  problem.model = BrakedMass();
  problem.fixed = {{"v0", kFirstSpeedMPerS}};
  problem.uncertain = {polyest::UncertainParameter::Normal("a", 4, 1).value()};
  problem.measured = {{.output = "x", .noise = {.absolute = 0.01}}};
  return problem;
}

absl::StatusOr<polyest::Estimate> EstimateFrom(const polyest::Problem& problem,
                                               const polyest::Samples& samples) {
  auto estimator = polyest::Estimator::Make(problem);
  if (!estimator.ok()) return estimator.status();
  if (auto status = (*estimator)->Append(samples); !status.ok()) return status;
  if (auto status = (*estimator)->Process(); !status.ok()) return status;
  return (*estimator)->CurrentEstimate();
}

// Samples without noise: only the expansion is wrong, and by less than the uncertainty.
bool Finds(double truth, const polyest::Problem& problem, const polyest::Samples& samples) {
  const auto estimate = EstimateFrom(problem, samples);
  if (!estimate.ok()) {
    std::fprintf(stderr, "%s\n", estimate.status().ToString().c_str());
    return false;
  }
  const polyest::ParameterEstimate& found = estimate->parameters.front();
  std::printf("%s = %.4f ± %.4f %s\n", found.name.c_str(), found.map, found.std_dev,
              found.unit.c_str());
  return std::abs(found.map - truth) < found.std_dev;
}

// The mean of x over the prior of a at t = 2 s is that of the mean deceleration: x is linear in a.
bool Predicts() {
  polyest::PropagationOptions options;
  options.until_s = 2;
  options.step_s = 1;
  const auto propagation = polyest::PropagatePrior(Braking(), options);
  return propagation.ok() &&
         std::abs(propagation->outputs.front().mean[2] - (2 * kFirstSpeedMPerS - 8)) < 1e-6;
}

// A prior that none of UncertainParameter's functions has made is refused, not trusted.
bool RefusesBadPriors() {
  polyest::Problem problem = Braking();
  problem.uncertain.front().scale = -1;
  return polyest::Estimator::Make(problem).status().code() == absl::StatusCode::kInvalidArgument;
}

}  // namespace

int main() {
  for (const auto& model : polyest::BuiltinModels()) {
    std::printf("%s: %s\n", model->description().name.c_str(),
                model->description().summary.c_str());
  }
  const polyest::Problem spring =
      Spring(polyest::FindBuiltinModel("mass_spring_damper").value(), "x0");
  const bool right = Finds(kStiffnessNPerM, spring, Sampled(FreeOscillation)) &&
                     Finds(kStiffnessNPerM, SpringAsText(), Sampled(FreeOscillation)) &&
                     Finds(kDecelerationMPerS2, Braking(), Sampled(BrakingDistance)) &&
                     Predicts() && RefusesBadPriors();
  return right ? 0 : 1;
}
