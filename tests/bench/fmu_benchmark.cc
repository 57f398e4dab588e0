// Compares the same oscillator as a built-in model, as text, and as an FMU of either kind: time per
// trajectory, and its ratio to that of the built-in model.
//
//   fmu_benchmark [POINTS] [SECONDS]

#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "core/model/equations/equation_model.h"
#include "tests/unit/core/fmu/fmu_ensemble.h"

namespace polyest::internal {
namespace {

// Returns the best time of several runs, µs per trajectory. It includes the start of the workers.
double MicrosecondsPerTrajectory(const std::shared_ptr<const Model>& model, int points,
                                 double until_s) {
  FmuEnsemble ensemble(model, points, {"x", "v"});
  ensemble.Set("m", 1);
  ensemble.Set("c", 0.1);
  for (int point = 0; point < points; ++point) ensemble.Set("k", point, 3 + 2.0 * point / points);
  for (const char* initial : {"x0", "x_0"}) {
    if (model->description().FindParameter(initial)) ensemble.Set(initial, 1);
  }
  const std::vector<double> times_s = TimesUntil(until_s, 0.02);
  double best_s = 1e9;
  for (int repetition = 0; repetition < 5; ++repetition) {
    const auto start = std::chrono::steady_clock::now();
    ensemble.Propagate(times_s);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    best_s = std::min(best_s, taken.count());
  }
  return 1e6 * best_s / points;
}

std::shared_ptr<const Model> OscillatorAsText() {
  return *MakeEquationModel({.states = {{"x", "v"}, {"v", "(force - c*v - k*x)/m"}},
                             .outputs = {{"x", "x"}, {"v", "v"}},
                             .parameters = {{"m", 1}, {"c", 0.1}, {"k", 4}},
                             .inputs = {"force"}});
}

void Run(int points, double until_s) {
  const double built_in =
      MicrosecondsPerTrajectory(*FindBuiltinModel("mass_spring_damper"), points, until_s);
  std::printf("%d trajectories of %g s, 50 samples a second\n", points, until_s);
  std::printf("%-18s %10.1f us\n", "built-in", built_in);
  const double text = MicrosecondsPerTrajectory(OscillatorAsText(), points, until_s);
  std::printf("%-18s %10.1f us  %8.1f times\n", "as text", text, text / built_in);
  for (const char* name :
       {"oscillator_me2", "oscillator_me3", "oscillator_cs2", "oscillator_cs3"}) {
    const double fmu = MicrosecondsPerTrajectory(*TestFmus().Find(name), points, until_s);
    std::printf("%-18s %10.1f us  %8.1f times\n", name, fmu, fmu / built_in);
  }
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  polyest::internal::Run(argc > 1 ? std::atoi(argv[1]) : 64, argc > 2 ? std::atof(argv[2]) : 10);
  return 0;
}
