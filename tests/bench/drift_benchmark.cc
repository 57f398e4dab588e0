// Measures an endless stream of a thousand rows per second, one of whose four unknowns drifts: the
// longest update, how much faster than real time the estimator is, its memory, and how often 95 %
// intervals hold the stiffness, looked at once a minute. Batches of a tenth of a second, an hour or
// as many minutes as the argument says, of a nonlinear oscillator that a force of two tones drives.
//
//   drift_benchmark [MINUTES]

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "core/common/check.h"
#include "polyest/equation_model.h"
#include "polyest/estimator.h"
#include "tests/bench/driven_oscillator.h"

namespace polyest::internal {
namespace {

using Rig = DrivenOscillator;
using Clock = std::chrono::steady_clock;

constexpr double kDrift = 0.05;  // N/m/√s
constexpr int kBatchesPerMinute = 600;

Problem Drifting() {
  Problem problem;
  problem.model =
      MakeEquationModel(
          {.states = {{"x", "v"}, {"v", "-k*x - c*v - d*x^3 + a*sin(5.1*t) + 3*sin(8.7*t)"}},
           .outputs = {{"x", "x"}}})
          .value();
  problem.uncertain = {UncertainParameter::Uniform("k", 20, 60).value(),
                       UncertainParameter::Uniform("c", 0.3, 2).value(),
                       UncertainParameter::Uniform("d", 5, 40).value(),
                       UncertainParameter::Uniform("a", 3, 5).value()};
  problem.uncertain[0].drift = RandomWalk{.std_dev_per_sqrt_s = kDrift};
  problem.measured = {{"x", {.absolute = Rig::kNoise}}};
  return problem;
}

double ResidentMegabytes() {
  std::ifstream in("/proc/self/statm");
  long all = 0, resident = 0;
  in >> all >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

void Run(int minutes) {
  Rig rig(kDrift);
  const auto estimator = Estimator::Make(Drifting()).value();
  double longest_s = 0, all_s = 0;
  int64_t longest_at = 0;
  int inside = 0;
  for (int minute = 1; minute <= minutes; ++minute) {
    for (int batch = 0; batch < kBatchesPerMinute; ++batch) {
      POLYEST_CHECK(estimator->Append(rig.Next()).ok());
      const Clock::time_point start = Clock::now();
      POLYEST_CHECK(estimator->Process().ok());
      const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
      all_s += seconds;
      if (seconds <= longest_s) continue;
      longest_s = seconds;
      longest_at = estimator->rows_processed();
    }
    const Estimate estimate = estimator->CurrentEstimate().value();
    const FilteredQuantity& k = estimate.filtered.back();
    inside += k.lower95 <= rig.stiffness() && rig.stiffness() <= k.upper95 ? 1 : 0;
    if (minute % 10 != 0 && minute != 1 && minute != minutes) continue;
    std::printf(
        "%3d min: k %.3f +- %.3f, truth %.3f, inside %d of %d; longest update %.2f s at row %lld; "
        "%.1f times real time; %.1f MB; %lld re-expansions\n",
        minute, k.mean, k.std_dev, rig.stiffness(), inside, minute, longest_s,
        static_cast<long long>(longest_at), 60.0 * minute / all_s, ResidentMegabytes(),
        static_cast<long long>(estimate.expansion.reexpansions));
    std::fflush(stdout);
  }
  const Estimate estimate = estimator->CurrentEstimate().value();
  for (const ParameterEstimate& parameter : estimate.parameters) {
    std::printf("%s %.5f +- %.5f\n", parameter.name.c_str(), parameter.mean, parameter.std_dev);
  }
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    std::printf("%s: %s\n", NameOf(diagnostic.code), diagnostic.message.c_str());
  }
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  const int minutes = argc > 1 ? std::atoi(argv[1]) : 60;
  if (minutes < 1 || argc > 2) {
    std::fprintf(stderr, "usage: drift_benchmark [MINUTES, 1 or more]\n");
    return EXIT_FAILURE;
  }
  polyest::internal::Run(minutes);
  return EXIT_SUCCESS;
}
