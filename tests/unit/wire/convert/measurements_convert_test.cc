#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "polyest/catalogue.h"
#include "proto/wire/convert/measurements.h"

namespace polyest::internal::measurements_convert_test {
namespace {

// Returns three rows of x and v; v lacks the second.
v1::Measurements ThreeRows() {
  v1::Measurements measurements;
  for (const double time : {0.1, 0.2, 0.1}) measurements.add_time_s(time);
  for (const int run : {0, 0, 1}) measurements.add_run(run);
  auto& x = *measurements.add_channels();
  x.set_name("x");
  for (const double value : {1.0, 2.0, 3.0}) x.add_values(value);
  auto& v = *measurements.add_channels();
  v.set_name("v");
  for (const double value : {4.0, std::nan(""), 6.0}) v.add_values(value);
  v.add_missing(1);
  return measurements;
}

const Model& MassOnASpring() {
  static const auto model = FindBuiltinModel("mass_spring_damper").value();
  return *model;
}

std::string MessageOf(const v1::Measurements& measurements) {
  const auto samples = ToSamples(measurements, MassOnASpring());
  EXPECT_EQ(samples.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(samples.status().message());
}

TEST(ToSamples, KeepsRowsRunsColumnsAndGaps) {
  const auto samples = ToSamples(ThreeRows(), MassOnASpring());
  ASSERT_TRUE(samples.ok()) << samples.status();
  EXPECT_EQ(samples->time_s, (std::vector<double>{0.1, 0.2, 0.1}));
  EXPECT_EQ(samples->run, (std::vector<int>{0, 0, 1}));
  ASSERT_EQ(samples->columns.size(), 2u);
  EXPECT_EQ(samples->columns[0].name, "x");
  EXPECT_EQ(samples->columns[0].value, (std::vector<double>{1, 2, 3}));
  EXPECT_TRUE(samples->columns[0].missing.empty());
  EXPECT_EQ(samples->columns[1].name, "v");
  EXPECT_EQ(samples->columns[1].missing, (std::vector<bool>{false, true, false}));
  EXPECT_EQ(samples->columns[1].value[2], 6);
}

TEST(ToSamples, RefusesTimesThatAreNotFinite) {
  v1::Measurements measurements = ThreeRows();
  measurements.set_time_s(1, std::numeric_limits<double>::infinity());
  EXPECT_EQ(MessageOf(measurements), "measurements.timeS[1]: inf must be finite");
}

TEST(ToSamples, RefusesRunsOfAnotherLength) {
  v1::Measurements measurements = ThreeRows();
  measurements.add_run(1);
  EXPECT_EQ(MessageOf(measurements),
            "measurements.run: 4 entries for 3 rows; must be one per row, or none");
}

TEST(ToSamples, RefusesColumnsOfAnotherLength) {
  v1::Measurements measurements = ThreeRows();
  measurements.mutable_channels(0)->add_values(9);
  EXPECT_EQ(MessageOf(measurements),
            "measurements.channels[0].values: 4 values of x for 3 rows; must be one per row");
}

TEST(ToSamples, RefusesAValueThatIsNotFiniteAndNotMissing) {
  v1::Measurements measurements = ThreeRows();
  measurements.mutable_channels(1)->clear_missing();
  EXPECT_EQ(MessageOf(measurements),
            "measurements.channels[1].values[1]: nan of v must be finite, or its row listed in "
            "missing");
}

TEST(ToSamples, RefusesMissingRowsThatDoNotExistOrIncrease) {
  v1::Measurements measurements = ThreeRows();
  measurements.mutable_channels(1)->add_missing(3);
  EXPECT_EQ(MessageOf(measurements),
            "measurements.channels[1].missing[1]: row 3 of v must be above 1 and below the number "
            "of rows, 3");
  measurements = ThreeRows();
  measurements.mutable_channels(1)->add_missing(1);
  EXPECT_EQ(MessageOf(measurements),
            "measurements.channels[1].missing[1]: row 1 of v must be above 1 and below the number "
            "of rows, 3");
  measurements = ThreeRows();
  measurements.mutable_channels(0)->add_missing(-1);
  EXPECT_EQ(MessageOf(measurements),
            "measurements.channels[0].missing[0]: row -1 of x must be above -1 and below the "
            "number of rows, 3");
}

TEST(ToSamples, RefusesAChannelWithoutAName) {
  v1::Measurements measurements = ThreeRows();
  measurements.mutable_channels(0)->clear_name();
  EXPECT_EQ(MessageOf(measurements), "measurements.channels[0].name: must not be empty");
}

TEST(ToSamples, ConvertsToTheUnitsOfTheModel) {
  v1::Measurements measurements = ThreeRows();
  measurements.mutable_channels(0)->set_unit("mm");
  measurements.mutable_channels(1)->set_unit("km/h");
  const auto samples = ToSamples(measurements, MassOnASpring());
  ASSERT_TRUE(samples.ok()) << samples.status();
  EXPECT_EQ(samples->columns[0].value, (std::vector<double>{0.001, 0.002, 0.003}));
  EXPECT_NEAR(samples->columns[1].value[0], 4 / 3.6, 1e-15);

  measurements.mutable_channels(0)->set_unit("kN");
  EXPECT_THAT(MessageOf(measurements), ::testing::StartsWith("measurements.channels[0].unit: x: "));
  measurements.mutable_channels(0)->set_unit("furlong");
  EXPECT_THAT(MessageOf(measurements), ::testing::HasSubstr("furlong"));
  measurements.mutable_channels(0)->set_name("speed");
  EXPECT_EQ(MessageOf(measurements),
            "measurements.channels[0].unit: \"furlong\": the model gives speed no unit to convert "
            "it to");
}

// Rows as they arrive within a reorder window: the input comes later than what is measured.
TEST(PutInTimeOrder, SortsRowsByRunAndTimeAndUnitesThoseOfTheSameTime) {
  v1::Measurements rows;
  for (const double t : {0.0, 0.2, 0.0, 0.1, 0.2, 0.0}) rows.add_time_s(t);
  for (const int run : {0, 0, 0, 0, 0, 1}) rows.add_run(run);
  v1::Measurements::Channel& x = *rows.add_channels();
  x.set_name("x");
  for (const double value : {1., 2., 0., 0., 0., 4.}) x.add_values(value);
  for (const int row : {2, 3, 4}) x.add_missing(row);
  v1::Measurements::Channel& u = *rows.add_channels();
  u.set_name("u");
  u.set_unit("N");
  for (const double value : {0., 0., 5., 6., 7., 0.}) u.add_values(value);
  for (const int row : {0, 1, 5}) u.add_missing(row);
  rows.set_end_of_run(true);
  PutInTimeOrder(rows);
  EXPECT_THAT(rows.time_s(), ::testing::ElementsAre(0, 0.1, 0.2, 0));
  EXPECT_THAT(rows.run(), ::testing::ElementsAre(0, 0, 0, 1));
  EXPECT_THAT(rows.channels(0).values(), ::testing::ElementsAre(1, 0, 2, 4));
  EXPECT_THAT(rows.channels(0).missing(), ::testing::ElementsAre(1));
  EXPECT_THAT(rows.channels(1).values(), ::testing::ElementsAre(5, 6, 7, 0));
  EXPECT_THAT(rows.channels(1).missing(), ::testing::ElementsAre(3));
  EXPECT_EQ(rows.channels(1).unit(), "N");
  EXPECT_TRUE(rows.end_of_run());
}

}  // namespace
}  // namespace polyest::internal::measurements_convert_test
