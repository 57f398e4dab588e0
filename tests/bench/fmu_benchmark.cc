// Compares the same oscillator as a built-in model, as text, and as an FMU of either kind: time per
// trajectory, its ratio to that of the built-in model, which has an exact step, and to that of the
// built-in model when it is integrated as an FMU is. oscillator_me3 declares that its derivatives
// do not depend on the time, oscillator_me2 does not, so that its steps end at each sample.
//
//   fmu_benchmark [POINTS] [SECONDS] [THREADS]

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "core/common/check.h"
#include "core/model/equations/equation_model.h"
#include "tests/unit/core/fmu/fmu_ensemble.h"

namespace polyest::internal {
namespace {

// Propagates the ensemble as an estimator does, so many samples at a time.
void Propagate(const FmuEnsemble& ensemble, std::span<const double> times_s) {
  constexpr size_t kSamplesAtOnce = 64;
  EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
  for (size_t first = 0; first < times_s.size(); first += kSamplesAtOnce) {
    const auto times = times_s.subspan(first, std::min(kSamplesAtOnce, times_s.size() - first));
    Matrix outputs(ensemble.points(),
                   std::ssize(times) * std::ssize(ensemble.specification.outputs));
    POLYEST_CHECK(propagator.Advance(times, outputs, Stop()).ok());
    POLYEST_CHECK(propagator.failures().empty());
  }
}

// Returns the best time of several runs, µs per trajectory. It includes the start of the workers.
double MicrosecondsPerTrajectory(const std::shared_ptr<const Model>& model, int points,
                                 double until_s, int threads) {
  FmuEnsemble ensemble(model, points, {"x", "v"});
  ensemble.Set("m", 1);
  ensemble.Set("c", 0.1);
  for (int point = 0; point < points; ++point) ensemble.Set("k", point, 3 + 2.0 * point / points);
  for (const char* initial : {"x0", "x_0"}) {
    if (model->description().FindParameter(initial)) ensemble.Set(initial, 1);
  }
  ensemble.specification.threads = threads;
  const std::vector<double> times_s = TimesUntil(until_s, 0.02);
  double best_s = 1e9;
  for (int repetition = 0; repetition < 5; ++repetition) {
    const auto start = std::chrono::steady_clock::now();
    Propagate(ensemble, times_s);
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

void Run(int points, double until_s, int threads) {
  const auto measure = [&](const std::shared_ptr<const Model>& model) {
    return MicrosecondsPerTrajectory(model, points, until_s, threads);
  };
  std::printf("%d trajectories of %g s, 50 samples a second, threads: %d\n", points, until_s,
              threads);
  const std::shared_ptr<const Model> built_in = *FindBuiltinModel("mass_spring_damper");
  const double exact_us = measure(built_in);
  const double integrated_us =
      measure(std::make_shared<UnknownEquations>(built_in, /*uses_time=*/false));
  const auto print = [&](const char* name, double time_us) {
    std::printf("%-22s %10.1f us %8.1f times %8.1f times\n", name, time_us, time_us / exact_us,
                time_us / integrated_us);
  };
  print("built-in", exact_us);
  print("built-in, integrated", integrated_us);
  print("as text", measure(OscillatorAsText()));
  for (const char* name :
       {"oscillator_me2", "oscillator_me3", "oscillator_cs2", "oscillator_cs3"}) {
    print(name, measure(*TestFmus().Find(name)));
  }
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  polyest::internal::Run(argc > 1 ? std::atoi(argv[1]) : 64, argc > 2 ? std::atof(argv[2]) : 10,
                         argc > 3 ? std::atoi(argv[3]) : 1);
  return 0;
}
