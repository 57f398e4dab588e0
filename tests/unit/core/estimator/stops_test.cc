// Stops the numerics at any of the moments at which they ask whether to end. What follows must be
// what would have followed without the stop, to the last bit. The program has no other tests, since
// its clock of deadlines counts questions.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "tests/testing/count_deadlines.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

constexpr int kRows = 40, kRowsABatch = 4;

// A free oscillation with a ripple that no model explains, so that the misfit is revised while the
// region moves.
Samples RippledRows(int first, int last) {
  constexpr double kDecay = 0.085;
  const double omega = std::sqrt(40.66 - kDecay * kDecay);
  Samples samples;
  samples.columns = {{"x", {}, {}}};
  for (int row = first; row < last; ++row) {
    const double t = 0.05 * (row + 1);
    const double free = std::cos(omega * t) + kDecay / omega * std::sin(omega * t);
    samples.time_s.push_back(t);
    samples.columns[0].value.push_back(
        1.07 * (std::exp(-kDecay * t) * free + 0.01 * std::sin(12.9898 * row)));
  }
  return samples;
}

Problem FreeOscillation() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"x0", 1}};
  problem.uncertain = {*UncertainParameter::Uniform("k", 31.58, 47.37),
                       *UncertainParameter::Uniform("c", 0.1, 0.3)};
  problem.measured = {{"x", {.absolute = 0.01}}};
  return problem;
}

// Takes the record batch by batch. Each is stopped after `patience` questions, then after twice as
// many, and so on until it is through.
Estimate EstimateWithStops(const Problem& problem, int64_t patience, int64_t& stops) {
  const auto estimator = MakeEstimator(problem);
  for (int row = 0; row < kRows; row += kRowsABatch) {
    EXPECT_TRUE(estimator->Append(RippledRows(row, row + kRowsABatch)).ok());
    for (int64_t more = patience;; more *= 2) {
      const absl::Status processed = estimator->Process(StopAt(times_asked + more));
      if (processed.ok()) break;
      EXPECT_EQ(processed.code(), absl::StatusCode::kDeadlineExceeded);
      ++stops;
    }
  }
  return estimator->CurrentEstimate().value();
}

void ExpectNoTraceOfStops(const Problem& problem) {
  int64_t stops = 0;
  const Estimate undisturbed = EstimateWithStops(problem, int64_t{1} << 60, stops);
  EXPECT_EQ(stops, 0);
  for (int64_t patience = 1; patience < 80; patience += 2) {
    SCOPED_TRACE(patience);
    ExpectSame(EstimateWithStops(problem, patience, stops), undisturbed);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(stops, 300);
}

TEST(Stops, LeaveNoTraceWhileTheMisfitIsRevised) { ExpectNoTraceOfStops(FreeOscillation()); }

TEST(Stops, LeaveNoTraceWhileTheNoiseIsLearned) {
  Problem problem = FreeOscillation();
  problem.measured[0].noise = {.unknown = true};
  ExpectNoTraceOfStops(problem);
}

}  // namespace
}  // namespace polyest::internal
