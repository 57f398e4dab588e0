#include "core/estimator/record/sample_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "polyest/catalogue.h"

namespace polyest::internal {
namespace {

std::vector<double> Row(const CheckedSamples& checked, const std::vector<double>& all, size_t row) {
  const auto width = static_cast<std::ptrdiff_t>(all.size() / checked.rows.size());
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(row) * width;
  return {begin, begin + width};
}

std::vector<double> RowValues(const CheckedSamples& checked, size_t row) {
  return Row(checked, checked.values, row);
}

std::vector<double> RowNoise(const CheckedSamples& checked, size_t row) {
  return Row(checked, checked.noise, row);
}

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Makes a problem with x and v measured and the force streamed.
ResolvedProblem StreamedProblem() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.uncertain = {UncertainParameter::Uniform("c", 0, 1).value()};
  problem.inputs = {{"force", StreamedInput{}}};
  problem.measured = {{"x", {.absolute = 0.1, .relative = 0.01, .relative_to_max = 0.001}},
                      {"v", {.relative = 0.5}}};
  return ResolvedProblem::Make(problem).value();
}

Samples ThreeRows() {
  Samples samples;
  samples.time_s = {0, 1, 2};
  samples.columns = {{"x", {1, -3, 2}, {}}, {"force", {5, 6, 7}, {}}};
  return samples;
}

class SampleChecksTest : public ::testing::Test {
 protected:
  std::string Refusal(const Samples& samples) const {
    const auto checked = checks_.Check(samples);
    EXPECT_EQ(checked.status().code(), absl::StatusCode::kInvalidArgument) << checked.status();
    return std::string(checked.status().message());
  }
  void Take(const Samples& samples) { checks_.Accept(checks_.Check(samples).value()); }

  const ResolvedProblem problem_ = StreamedProblem();
  SampleChecks checks_{problem_};
};

TEST_F(SampleChecksTest, PlaceValuesByTheProblemsOrderWithNanWhereMissing) {
  const CheckedSamples checked = checks_.Check(ThreeRows()).value();
  ASSERT_EQ(checked.rows.size(), 3u);
  EXPECT_EQ(checked.rows[2].time_s, 2);
  EXPECT_EQ(checked.rows[2].run, 0);
  EXPECT_THAT(RowValues(checked, 1), ElementsAre(-3, ::testing::IsNan(), 6));
  EXPECT_EQ(RowNoise(checked, 1)[1], 0);
}

// The noise is σ = absolute + relative |z| + relative_to_max max |z|, with the maximum up to the
// sample itself.
TEST_F(SampleChecksTest, GiveNoiseWithTheMaximumSoFar) {
  const CheckedSamples checked = checks_.Check(ThreeRows()).value();
  EXPECT_DOUBLE_EQ(RowNoise(checked, 0)[0], 0.1 + 0.01 * 1 + 0.001 * 1);
  EXPECT_DOUBLE_EQ(RowNoise(checked, 1)[0], 0.1 + 0.01 * 3 + 0.001 * 3);
  EXPECT_DOUBLE_EQ(RowNoise(checked, 2)[0], 0.1 + 0.01 * 2 + 0.001 * 3);
}

TEST_F(SampleChecksTest, GiveTheSameNoiseHoweverTheRecordIsCut) {
  const CheckedSamples whole = checks_.Check(ThreeRows()).value();
  for (size_t k = 0; k < 3; ++k) {
    Samples row;
    row.time_s = {ThreeRows().time_s[k]};
    row.columns = {{"x", {ThreeRows().columns[0].value[k]}, {}},
                   {"force", {ThreeRows().columns[1].value[k]}, {}}};
    const CheckedSamples checked = checks_.Check(row).value();
    EXPECT_EQ(RowNoise(checked, 0), RowNoise(whole, k));
    checks_.Accept(checked);
  }
}

TEST_F(SampleChecksTest, IgnoreTheValueOfAMissingSample) {
  Samples samples = ThreeRows();
  samples.columns[0].value[1] = kNan;
  samples.columns[0].missing = {false, true, false};
  const CheckedSamples checked = checks_.Check(samples).value();
  EXPECT_TRUE(std::isnan(RowValues(checked, 1)[0]));
  EXPECT_EQ(RowNoise(checked, 1)[0], 0);
  // The value 3 was not measured.
  EXPECT_DOUBLE_EQ(RowNoise(checked, 2)[0], 0.1 + 0.01 * 2 + 0.001 * 2);
}

// Relative noise has no size before there is a value, whatever the unit.
TEST_F(SampleChecksTest, TakeValuesOfZeroBeforeAnyOtherForMissing) {
  for (const double unit : {1e-9, 1.0, 1e9}) {
    Samples samples = ThreeRows();
    samples.columns.push_back({"v", {1e-110 * unit, 4 * unit, 0}, {}});
    const CheckedSamples checked = checks_.Check(samples).value();
    EXPECT_EQ(RowNoise(checked, 0)[1], 0);
    EXPECT_TRUE(std::isnan(RowValues(checked, 0)[1]));
    EXPECT_DOUBLE_EQ(RowNoise(checked, 1)[1], 2 * unit);
    // Later the zeros have the noise of a small part of the range.
    EXPECT_DOUBLE_EQ(RowNoise(checked, 2)[1], 2 * NoiseModel::kMinMagnitude * unit);
    EXPECT_EQ(RowValues(checked, 2)[1], 0);
  }
}

TEST(NoiseOfTheSamples, IsTheNumberGivenHoweverSmall) {
  EXPECT_EQ(NoiseModel{.absolute = 1e-15}.StandardDeviation(1e-12, 1e-12), 1e-15);
}

TEST(NoiseOfTheSamples, IsThatOfTheFullScaleFromTheFirstSampleOn) {
  const NoiseModel noise{.relative_to_max = 0.001, .full_scale = 50};
  EXPECT_EQ(noise.StandardDeviation(0, 0), 0.05);
  EXPECT_EQ(noise.StandardDeviation(20, 20), 0.05);
}

TEST_F(SampleChecksTest, ChangeNothingUntilAccepted) {
  EXPECT_TRUE(checks_.Check(ThreeRows()).ok());
  Samples earlier = ThreeRows();
  earlier.time_s = {0, 0.5, 0.75};
  earlier.columns[0].value = {1, 1, 1};
  const CheckedSamples checked = checks_.Check(earlier).value();
  // The maximum leaves out the 3 of the batch before.
  EXPECT_DOUBLE_EQ(RowNoise(checked, 2)[0], 0.1 + 0.01 + 0.001);
}

TEST_F(SampleChecksTest, TakeRunsThatBeginAgainAtZero) {
  Samples samples = ThreeRows();
  samples.run = {0, 0, 1};
  samples.time_s = {0, 5, 0};
  Take(samples);
  Samples next = ThreeRows();
  next.run = {1, 3, 3};  // A run without samples may be left out.
  next.time_s = {1, 0, 1};
  EXPECT_TRUE(checks_.Check(next).ok());
}

TEST_F(SampleChecksTest, RefuseNoRows) {
  EXPECT_EQ(Refusal(Samples()), "the measurements have no rows");
}

TEST_F(SampleChecksTest, AnswerAnUnknownColumnWithTheColumnsThereAre) {
  Samples samples = ThreeRows();
  samples.columns.push_back({"a", {1, 2, 3}, {}});
  EXPECT_EQ(Refusal(samples),
            "column \"a\" is neither a measured output nor a streamed input of the problem; it has "
            "x, v, force");
}

TEST_F(SampleChecksTest, RefuseAColumnGivenTwice) {
  Samples samples = ThreeRows();
  samples.columns.push_back(samples.columns[0]);
  EXPECT_EQ(Refusal(samples), "column x is given twice");
}

TEST_F(SampleChecksTest, RefuseColumnsOfAnotherLength) {
  Samples samples = ThreeRows();
  samples.columns[0].value.pop_back();
  EXPECT_EQ(Refusal(samples), "column x: 2 values for 3 rows");
  samples = ThreeRows();
  samples.run = {0, 0, 0, 0};
  EXPECT_EQ(Refusal(samples), "run: 4 values for 3 rows");
  samples = ThreeRows();
  samples.columns[0].missing = {true};
  EXPECT_EQ(Refusal(samples), "column x: 1 missing flags for 3 rows");
}

TEST_F(SampleChecksTest, RefuseTimesThatAreNone) {
  for (const double time_s : {-0.5, kNan, std::numeric_limits<double>::infinity()}) {
    Samples samples = ThreeRows();
    samples.time_s[1] = time_s;
    EXPECT_THAT(Refusal(samples), ::testing::StartsWith("row 1 (counted from 0), column t: "));
    EXPECT_THAT(Refusal(samples), HasSubstr("must be a finite time ≥ 0"));
  }
}

TEST_F(SampleChecksTest, RefuseTimesThatNoSolverCouldReach) {
  for (const double time_s : {5e-324, 1e-31, 1.8e15, 1e308}) {
    Samples samples = ThreeRows();
    samples.time_s =
        time_s < 1 ? std::vector<double>{0, time_s, 1} : std::vector<double>{0, time_s, 1.5e308};
    EXPECT_THAT(Refusal(samples), HasSubstr("must be 0 or a time from 1e-30 to 1e+12 s"));
    samples.time_s[2] = samples.time_s[1];
    EXPECT_THAT(std::string(checks_.CheckInAnyOrder(samples).message()),
                HasSubstr("must be 0 or a time from 1e-30 to 1e+12 s"));
  }
  Samples samples = ThreeRows();
  samples.time_s = {0, 1e-30, 1e12};
  EXPECT_TRUE(checks_.Check(samples).ok());
}

TEST_F(SampleChecksTest, RefuseTimesThatDoNotIncrease) {
  for (const double time_s : {1.0, 0.5}) {
    Samples samples = ThreeRows();
    samples.time_s[2] = time_s;
    EXPECT_THAT(Refusal(samples), HasSubstr("row 2 (counted from 0), column t: "));
    EXPECT_THAT(Refusal(samples), HasSubstr("after 1; times must increase within a run"));
  }
}

TEST_F(SampleChecksTest, RefuseTimesThatGoBackFromBatchToBatch) {
  Take(ThreeRows());
  Samples next = ThreeRows();
  next.time_s = {2, 3, 4};
  EXPECT_EQ(Refusal(next),
            "row 0 (counted from 0), column t: 2 after 2; times must increase within a run");
  next.time_s = {2.5, 3, 4};
  EXPECT_TRUE(checks_.Check(next).ok());
}

TEST_F(SampleChecksTest, RefuseARecordThatDoesNotBeginWithRunZero) {
  for (const int run : {1, -1}) {
    Samples samples = ThreeRows();
    samples.run = {run, run, run};
    EXPECT_THAT(Refusal(samples), HasSubstr("row 0 (counted from 0), column run: "));
    EXPECT_THAT(Refusal(samples), HasSubstr("runs start at 0 and never decrease"));
  }
}

TEST_F(SampleChecksTest, RefuseRunsThatDecrease) {
  Samples samples = ThreeRows();
  samples.run = {0, 1, 0};
  EXPECT_EQ(Refusal(samples),
            "row 2 (counted from 0), column run: 0 after 1; runs start at 0 and never decrease");
  samples.run = {0, 1, 1};
  samples.time_s = {0, 1, 2};
  Take(samples);
  Samples next = ThreeRows();
  next.time_s = {3, 4, 5};  // The rows belong to run 0 if none is given.
  EXPECT_EQ(Refusal(next),
            "row 0 (counted from 0), column run: 0 after 1; runs start at 0 and never decrease");
}

TEST_F(SampleChecksTest, TakeAnyColumnMissingInAnyRow) {
  Samples samples = ThreeRows();
  samples.columns[1].missing = {false, false, true};
  samples.columns[0].missing = {true, false, true};
  EXPECT_TRUE(checks_.Check(samples).ok());
  const CheckedSamples checked = checks_.Check(samples).value();
  ASSERT_EQ(checked.after.knots.size(), 1);
  EXPECT_EQ(checked.after.knots[0].count, 2);
  EXPECT_EQ(checked.after.knots[0].last[0], 1);
  samples.columns.clear();
  EXPECT_TRUE(checks_.Check(samples).ok());
}

TEST_F(SampleChecksTest, RefuseValuesThatAreNoNumbers) {
  Samples samples = ThreeRows();
  samples.columns[0].value[1] = kNan;
  EXPECT_EQ(Refusal(samples),
            "row 1 (counted from 0), column x: nan must be a finite number, of at most 1e100 in "
            "magnitude");
  samples = ThreeRows();
  samples.columns[1].value[0] = -std::numeric_limits<double>::infinity();
  EXPECT_EQ(Refusal(samples),
            "row 0 (counted from 0), column force: -inf must be a finite number, of at most 1e100 "
            "in magnitude");
  samples.columns[1].value[0] = -2e100;  // its square would soon be infinite
  EXPECT_EQ(Refusal(samples),
            "row 0 (counted from 0), column force: -2e+100 must be a finite number, of at most "
            "1e100 in magnitude");
}

}  // namespace
}  // namespace polyest::internal
