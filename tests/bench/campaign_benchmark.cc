// Measures the time and memory of a campaign of runs that differ in their initial velocity, and
// compares the estimate with the exact posterior.
//
//   campaign_benchmark [RUNS]

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "core/common/check.h"
#include "tests/testing/campaign.h"

namespace polyest::internal {
namespace {

long PeakMemoryMb() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

void Compare(const Estimate& estimate, const std::string& name, double mean, double std_dev) {
  for (const ParameterEstimate& parameter : estimate.parameters) {
    if (parameter.name != name) continue;
    std::printf("%s: %.6g ± %.2g, %.3f standard deviations off; their ratio is %.4f\n",
                name.c_str(), parameter.mean, parameter.posterior_std_dev,
                (parameter.mean - mean) / std_dev, parameter.posterior_std_dev / std_dev);
  }
}

void Measure(int runs) {
  const Samples samples = Campaign::MakeRuns(runs);
  auto estimator = Estimator::Make(Campaign::MakeProblem());
  POLYEST_CHECK(estimator.ok());
  POLYEST_CHECK((*estimator)->Append(samples).ok());
  const long before = PeakMemoryMb();
  const auto start = std::chrono::steady_clock::now();
  POLYEST_CHECK((*estimator)->Process().ok());
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto estimate = (*estimator)->CurrentEstimate();
  POLYEST_CHECK(estimate.ok());
  std::printf("%d runs: %.1f s, peak memory %ld MB, of which %ld MB with the samples before\n",
              runs, seconds, PeakMemoryMb(), before);
  const CampaignOracle oracle = OracleOf(samples);
  Compare(*estimate, "k", oracle.mode[0], std::sqrt(oracle.covariance(0, 0)));
  Compare(*estimate, "c", oracle.mode[1], std::sqrt(oracle.covariance(1, 1)));
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 10'000;
  POLYEST_CHECK(runs > 0);
  polyest::internal::Measure(runs);
}
