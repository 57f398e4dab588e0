// Measures the longest update of an endless stream of a thousand rows per second, with and without
// a limit on the rows that are propagated again: batches of a tenth of a second, an hour or as many
// minutes as the argument says, of a nonlinear oscillator that a force of two tones drives.
//
//   update_benchmark [MINUTES]

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "core/common/check.h"
#include "polyest/equation_model.h"
#include "polyest/estimator.h"
#include "tests/bench/driven_oscillator.h"

namespace polyest::internal {
namespace {

using Rig = DrivenOscillator;
using Clock = std::chrono::steady_clock;

Problem Oscillator(LikelihoodForm likelihood, std::optional<int64_t> limit) {
  Problem problem;
  problem.model =
      MakeEquationModel(
          {.states = {{"x", "v"}, {"v", "-k*x - c*v - d*x^3 + 4*sin(5.1*t) + 3*sin(8.7*t)"}},
           .outputs = {{"x", "x"}},
           .parameters = {{"k", Rig::kStiffness}, {"c", Rig::kDamping}, {"d", Rig::kCubic}}})
          .value();
  problem.uncertain = {UncertainParameter::Uniform("k", 30, 50).value(),
                       UncertainParameter::Uniform("c", 0.3, 2).value()};
  problem.measured = {{"x", {.absolute = Rig::kNoise}}};
  problem.likelihood = likelihood;
  if (likelihood == LikelihoodForm::kPredictionError) {
    problem.process_noise = {{.state = "v", .spectral_density = 1e-6}};
  }
  problem.expansion.max_replay_row_count = limit;
  return problem;
}

void Measure(const char* name, LikelihoodForm likelihood, std::optional<int64_t> limit,
             int minutes) {
  Rig rig;
  const auto estimator = Estimator::Make(Oscillator(likelihood, limit)).value();
  double longest_s = 0, all_s = 0;
  int64_t longest_at = 0;
  for (int64_t batch = 0; batch < int64_t{600} * minutes; ++batch) {
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
  const ParameterEstimate &k = estimate.parameters[0], &c = estimate.parameters[1];
  std::printf("%-16s  %9lld  %7.2f s at row %8lld  %8.0f rows/s  %9.1e (sd %.1e)  %9.1e (sd %.1e)",
              name, static_cast<long long>(limit.value_or(0)), longest_s,
              static_cast<long long>(longest_at),
              static_cast<double>(estimator->rows_processed()) / all_s, k.mean - Rig::kStiffness,
              k.posterior_std_dev, c.mean - Rig::kDamping, c.posterior_std_dev);
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    std::printf("  %s", NameOf(diagnostic.code));
  }
  std::printf("\n");
  std::fflush(stdout);
}

void Run(int minutes) {
  std::printf("likelihood            limit  longest update                  speed  k - truth%22s\n",
              "c - truth");
  for (const int64_t rows : {0, 50'000, 16'384}) {
    const std::optional<int64_t> limit = rows > 0 ? std::optional<int64_t>(rows) : std::nullopt;
    Measure("OUTPUT_ERROR", LikelihoodForm::kOutputError, limit, minutes);
    Measure("PREDICTION_ERROR", LikelihoodForm::kPredictionError, limit, minutes);
  }
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  const int minutes = argc > 1 ? std::atoi(argv[1]) : 60;
  if (minutes < 1 || argc > 2) {
    std::fprintf(stderr, "usage: update_benchmark [MINUTES, 1 or more]\n");
    return EXIT_FAILURE;
  }
  polyest::internal::Run(minutes);
  return EXIT_SUCCESS;
}
