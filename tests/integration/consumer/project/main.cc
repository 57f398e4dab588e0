// A user's program: lists the built-in models, then estimates a spring's stiffness from the free
// oscillation x = cos(√(k/m) t) of a mass on it. Exit status 0 when the estimate is right.

#include <cmath>
#include <cstdio>

#include "core/estimator/estimator.h"
#include "core/model/catalogue.h"

namespace {

constexpr double kMassKg = 1;
constexpr double kStiffnessNPerM = 40;

polyest::Samples FreeOscillation() {
  polyest::Samples samples;
  polyest::SampleColumn x{.name = "x", .value = {}, .missing = {}};
  for (int k = 1; k <= 40; ++k) {
    const double time_s = 0.05 * k;
    samples.time_s.push_back(time_s);
    x.value.push_back(std::cos(std::sqrt(kStiffnessNPerM / kMassKg) * time_s));
  }
  samples.columns.push_back(x);
  return samples;
}

absl::StatusOr<polyest::Estimate> EstimateStiffness() {
  polyest::Problem problem;
  problem.model = polyest::FindBuiltinModel("mass_spring_damper").value();
  problem.fixed = {{"m", kMassKg}, {"x0", 1.0}};
  problem.uncertain = {polyest::UncertainParameter::Uniform("k", 30, 50).value()};
  problem.measured = {{.output = "x", .noise = {.absolute = 0.01}}};

  auto resolved = polyest::ResolvedProblem::Make(problem);
  if (!resolved.ok()) return resolved.status();
  auto estimator = polyest::Estimator::Make(*std::move(resolved));
  if (!estimator.ok()) return estimator.status();
  if (auto status = (*estimator)->Append(FreeOscillation()); !status.ok()) return status;
  if (auto status = (*estimator)->Process(); !status.ok()) return status;
  return (*estimator)->CurrentEstimate();
}

}  // namespace

int main() {
  for (const auto& model : polyest::BuiltinModels()) {
    std::printf("%s: %s\n", model->description().name.c_str(),
                model->description().summary.c_str());
  }
  const auto estimate = EstimateStiffness();
  if (!estimate.ok()) {
    std::fprintf(stderr, "%s\n", estimate.status().ToString().c_str());
    return 1;
  }
  const polyest::ParameterEstimate& k = estimate->parameters.front();
  std::printf("k = %.4f ± %.4f %s\n", k.map, k.std_dev, k.unit.c_str());
  // Samples without noise: only the expansion is wrong, and by less than the uncertainty.
  return std::abs(k.map - kStiffnessNPerM) < k.std_dev ? 0 : 1;
}
