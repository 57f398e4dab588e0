// Tests on random small problems whether stops leave no trace: the numerics are stopped at many of
// the moments at which they ask whether to end, and the estimate must be that of an undisturbed
// record, to the last bit.
//
//   stops COUNT [FIRST_SEED]
//
// Prints each problem whose estimate changes, with its seed. Exits with 1 if there is one, or if
// there were fewer than 20 stops a problem.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "polyest/estimator.h"
#include "tests/properties/problems.h"
#include "tests/testing/count_deadlines.h"

namespace polyest::internal::properties {
namespace {

constexpr int kRounds = 4;                // of each problem, stopped at other moments
constexpr double kFirstPatience = 0.025;  // of the questions of an undisturbed record
constexpr double kMorePatience = 1.05;    // after each stop, so that every record gets through
constexpr int64_t kMinStops = 20;

// What an estimate says, as text in which every bit shows.
std::string TextOf(const Estimate& estimate) {
  std::string text;
  char buffer[40];
  for (const ParameterEstimate& one : estimate.parameters) {
    for (const double value :
         {one.mean, one.posterior_std_dev, one.lower95, one.upper95, one.map}) {
      std::snprintf(buffer, sizeof buffer, "%a ", value);
      text += buffer;
    }
  }
  for (const Diagnostic& one : estimate.diagnostics) text += "\n" + one.message;
  return text;
}

// Takes the record in one piece, stopped after `patience` questions at first.
std::string TextWithStops(const SmallProblem& small, double patience, int64_t& stops) {
  auto estimator = Estimator::Make(small.problem);
  if (!estimator.ok()) return std::string(estimator.status().message());
  const absl::Status appended = (*estimator)->Append(small.record);
  if (!appended.ok()) return std::string(appended.message());
  for (;; patience *= kMorePatience) {
    const auto more = static_cast<int64_t>(patience);
    const absl::Status processed = (*estimator)->Process(StopAt(times_asked + more));
    if (processed.ok()) break;
    if (processed.code() != absl::StatusCode::kDeadlineExceeded) {
      return std::string(processed.message());
    }
    ++stops;
  }
  const absl::StatusOr<Estimate> estimate = (*estimator)->CurrentEstimate();
  return estimate.ok() ? TextOf(*estimate) : std::string(estimate.status().message());
}

// Returns the number of rounds in which the estimate changed.
int Changes(uint64_t seed, int64_t& stops) {
  const SmallProblem small = DrawProblem(seed);
  const int64_t before = times_asked;
  const std::string undisturbed = TextWithStops(small, 1e18, stops);
  const auto questions = static_cast<double>(times_asked - before);
  int changes = 0;
  for (int round = 0; round < kRounds; ++round) {
    const double patience = questions * kFirstPatience * (1 + 0.2 * round);
    if (TextWithStops(small, patience, stops) == undisturbed) continue;
    ++changes;
    std::printf("seed %d, round %d: a stop changed the estimate\n", static_cast<int>(seed), round);
  }
  return changes;
}

int Run(uint64_t first, int count) {
  int64_t stops = 0;
  int changes = 0;
  for (int i = 0; i < count; ++i) changes += Changes(first + static_cast<uint64_t>(i), stops);
  std::printf("%d problems, %lld stops, %d changed estimates\n", count,
              static_cast<long long>(stops), changes);
  return changes == 0 && stops >= kMinStops * count ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace polyest::internal::properties

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 20;
  if (count <= 0) {
    std::fprintf(stderr, "stops: COUNT must be at least 1\n");
    return 2;
  }
  const uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  return polyest::internal::properties::Run(first, count);
}
