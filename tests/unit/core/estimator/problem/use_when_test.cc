// The condition under which a row's samples are used.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/sample_checks.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using testing::EstimateInBatches;
using ::testing::HasSubstr;

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

Problem GatedProblem(const std::string& use_when) {
  Problem problem = TextProblem("a + 0*t", {UncertainParameter::Normal("a", 0, 10).value()}, 0.5);
  problem.use_when = use_when;
  return problem;
}

// y is 1 where it may be used and 100 elsewhere. NaN stands for a missing cell.
Samples Gated(const std::vector<double>& y, const std::vector<double>& speed,
              const std::vector<int>& run = {}) {
  Samples samples;
  samples.columns = {{"y", {}, {}}, {"speed", {}, {}}};
  samples.run = run;
  for (size_t k = 0; k < y.size(); ++k) {
    samples.time_s.push_back(static_cast<double>(k));
    for (const auto& [column, value] : {std::pair{0, y[k]}, std::pair{1, speed[k]}}) {
      samples.columns[static_cast<size_t>(column)].value.push_back(value);
      samples.columns[static_cast<size_t>(column)].missing.push_back(std::isnan(value));
    }
  }
  return samples;
}

std::vector<bool> UsedOf(const std::string& use_when, const Samples& samples) {
  const ResolvedProblem problem = ResolvedProblem::Make(GatedProblem(use_when)).value();
  const CheckedSamples checked = SampleChecks(problem).Check(samples).value();
  std::vector<bool> used;
  for (const double sigma : checked.noise) used.push_back(sigma > 0);
  EXPECT_EQ(checked.left_out, std::count(used.begin(), used.end(), false));
  return used;
}

TEST(UseWhen, HoldsTheLastValueOfItsRun) {
  const Samples samples =
      Gated({1, 1, 1, 1, 1, 1, 1}, {kNoValue, 6, kNoValue, 4, kNoValue, kNoValue, 7},
            {0, 0, 0, 0, 0, 1, 1});
  EXPECT_EQ(UsedOf("speed > 5", samples),
            (std::vector<bool>{false, true, true, false, false, false, true}));
  EXPECT_EQ(UsedOf("!(speed > 5)", samples),
            (std::vector<bool>{false, false, false, true, true, false, false}));
  EXPECT_EQ(UsedOf("t >= 3 && speed > 5", samples),
            (std::vector<bool>{false, false, false, false, false, false, true}));
  EXPECT_EQ(UsedOf("y > 0 && speed > 0", samples),
            (std::vector<bool>{false, true, true, true, true, false, true}));
}

TEST(UseWhen, LeavesSamplesOutOfTheEstimate) {
  const Samples samples = Gated({1, 100, 1.2, 100, 100, 100, 1}, {9, 1, 9, 2, kNoValue, 3, 7});
  Samples used =
      Gated({1, kNoValue, 1.2, kNoValue, kNoValue, kNoValue, 1}, std::vector<double>(7, 0));
  used.columns.pop_back();
  const Estimate gated = EstimateInBatches(GatedProblem("speed > 5"), samples, 3);
  EXPECT_EQ(gated.samples, 3);
  ExpectSame(gated, EstimateInBatches(GatedProblem(""), used, 7));
  ExpectSame(gated, EstimateInBatches(GatedProblem("speed > 5"), samples, 1));
}

TEST(UseWhen, SaysSoIfItHoldsInNoRow) {
  const Estimate estimate = EstimateOf(GatedProblem("speed > 50"), Gated({1, 1, 1}, {9, 9, 9}));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kSuspiciousData),
              HasSubstr("no sample of it in rows for which useWhen holds"));
  EXPECT_EQ(estimate.samples, 0);
}

std::string RefusalOfGate(const std::string& use_when) {
  return std::string(ResolvedProblem::Make(GatedProblem(use_when)).status().message());
}

TEST(UseWhen, IsRefusedWithThePlaceInItsText) {
  EXPECT_THAT(RefusalOfGate("speed >"), HasSubstr("use_when: column 8"));
  EXPECT_THAT(RefusalOfGate("speed > 5 && sinus(y)"), HasSubstr("use_when: column 14"));
  const ResolvedProblem problem = ResolvedProblem::Make(GatedProblem("speed > 5")).value();
  Samples samples = Gated({1}, {9});
  samples.columns[1].name = "sped";
  EXPECT_THAT(std::string(SampleChecks(problem).Check(samples).status().message()),
              HasSubstr("nor in useWhen; it has y, speed"));
}

}  // namespace
}  // namespace polyest::internal
