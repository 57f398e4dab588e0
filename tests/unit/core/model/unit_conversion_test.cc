#include "core/model/unit_conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

double Converted(double value, const std::string& recorded, const std::string& model) {
  const auto conversion = ConvertUnit(recorded, model);
  EXPECT_TRUE(conversion.ok()) << conversion.status();
  return conversion.ok() ? (*conversion)(value) : 0;
}

std::string Refusal(const std::string& recorded, const std::string& model) {
  return std::string(ConvertUnit(recorded, model).status().message());
}

TEST(UnitConversion, GivesTheNearestDouble) {
  // These are equal to the last bit, since a division by a power of ten is rounded correctly.
  EXPECT_EQ(Converted(12.3, "mm", "m"), 12.3 / 1000);
  EXPECT_EQ(Converted(7, "ms", "s"), 0.007);
  EXPECT_EQ(Converted(1.5, "kN", "N"), 1500);
  EXPECT_EQ(Converted(3, "min", "s"), 180);
  EXPECT_EQ(Converted(2, "bar", "Pa"), 2e5);
  EXPECT_EQ(Converted(250, "µm", "mm"), 0.25);
}

TEST(UnitConversion, ConvertsWhatTestRigsRecord) {
  EXPECT_DOUBLE_EQ(Converted(36, "km/h", "m/s"), 10);
  EXPECT_DOUBLE_EQ(Converted(180, "deg", "rad"), std::numbers::pi);
  EXPECT_DOUBLE_EQ(Converted(180, "°/s", "rad/s"), std::numbers::pi);
  EXPECT_DOUBLE_EQ(Converted(60, "U/min", "rad/s"), 2 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(Converted(50, "%", "1"), 0.5);
  EXPECT_DOUBLE_EQ(Converted(1, "N/mm", "N/m"), 1000);
  EXPECT_DOUBLE_EQ(Converted(1, "in", "mm"), 25.4);
  EXPECT_DOUBLE_EQ(Converted(2, "kNm", "N m"), 2000);
}

TEST(UnitConversion, TakesGramsForGravityWhereTheModelHasAnAcceleration) {
  EXPECT_DOUBLE_EQ(Converted(2, "g", "m/s^2"), 2 * 9.80665);
  EXPECT_DOUBLE_EQ(Converted(2000, "mg", "m/s^2"), 2 * 9.80665);
  EXPECT_DOUBLE_EQ(Converted(2, "g", "kg"), 0.002);
}

TEST(UnitConversion, LeavesTheSameUnitAlone) {
  for (const char* const unit : {"m", "N s/m", "1", "quux"}) {
    const auto conversion = ConvertUnit(unit, unit);
    ASSERT_TRUE(conversion.ok()) << unit;
    EXPECT_TRUE(conversion->IsIdentity()) << unit;
  }
  EXPECT_TRUE(ConvertUnit("-", "1")->IsIdentity());
  EXPECT_TRUE(ConvertUnit("J", "N m")->IsIdentity());
}

TEST(UnitConversion, RefusesOtherDimensionsAndUnreadableUnits) {
  EXPECT_EQ(Refusal("kN", "m"),
            "values in \"kN\" cannot be converted to \"m\": their dimensions differ");
  EXPECT_THAT(Refusal("quux", "m"), HasSubstr("unknown symbol \"quux\""));
  EXPECT_THAT(Refusal("m", "quux"), HasSubstr("unknown symbol \"quux\""));
  EXPECT_FALSE(CheckRecordedUnit("quux").ok());
  EXPECT_TRUE(CheckRecordedUnit("U/min").ok());
}

TEST(UnitConversion, AddsTheZeroOfCelsiusToTemperatures) {
  for (const char* const celsius : {"°C", "deg C", "degC", "Celsius"}) {
    EXPECT_TRUE(CheckRecordedUnit(celsius).ok()) << celsius;
    EXPECT_DOUBLE_EQ(Converted(20, celsius, "K"), 293.15) << celsius;
    EXPECT_DOUBLE_EQ(Converted(20, celsius, "mK"), 293'150) << celsius;
    EXPECT_FALSE(ConvertUnit(celsius, "K")->IsIdentity()) << celsius;
  }
  EXPECT_THAT(Refusal("°C", "rad"), HasSubstr("their dimensions differ"));
  EXPECT_FALSE(CheckRecordedUnit("W/°C").ok());
}

TEST(UnitConversion, ReadsWhatLoggersWrite) {
  EXPECT_DOUBLE_EQ(Converted(3, "m/s2", "m/s^2"), 3);
  EXPECT_DOUBLE_EQ(Converted(1, "inch", "mm"), 25.4);
}

TEST(UnitConversion, RefusesCyclesForAngles) {
  for (const char* const angular : {"rad/s", "deg/s", "°/s", "rpm"}) {
    EXPECT_THAT(Refusal("Hz", angular), HasSubstr("one counts cycles, the other angles"));
    EXPECT_THAT(Refusal(angular, "Hz"), HasSubstr("one counts cycles, the other angles"));
  }
  EXPECT_DOUBLE_EQ(Converted(2, "kHz", "Hz"), 2000);
}

TEST(UnitConversion, ReadsTurnsPerMinuteWhereTheModelHasAnAngularVelocity) {
  for (const char* const turns : {"1/min", "min-1", "min^-1", "min⁻¹", "1 / min", "U/min", "rpm"}) {
    EXPECT_TRUE(CheckRecordedUnit(turns).ok()) << turns;
    EXPECT_DOUBLE_EQ(Converted(60, turns, "rad/s"), 2 * std::numbers::pi) << turns;
    EXPECT_DOUBLE_EQ(Converted(1, turns, "deg/s"), 6) << turns;
    EXPECT_DOUBLE_EQ(Converted(1, turns, "rpm"), 1) << turns;
  }
}

TEST(UnitConversion, ReadsRatesWhereTheModelHasARate) {
  for (const char* const rate : {"1/min", "min-1", "min^-1", "U/min"}) {
    EXPECT_DOUBLE_EQ(Converted(60, rate, "1/s"), 1) << rate;
    EXPECT_DOUBLE_EQ(Converted(60, rate, "Hz"), 1) << rate;
    EXPECT_DOUBLE_EQ(Converted(3, rate, "1/min"), 3) << rate;
  }
  EXPECT_DOUBLE_EQ(Converted(2, "s-1", "1/s"), 2);
  EXPECT_DOUBLE_EQ(Converted(2, "rad/s", "1/s"), 2);
}

// The SI leaves the radian out.
TEST(UnitConversion, ReadsRatesPerSecondAsAngularVelocities) {
  EXPECT_DOUBLE_EQ(Converted(2, "1/s", "rad/s"), 2);
  EXPECT_DOUBLE_EQ(Converted(2, "1/s^2", "rad/s^2"), 2);
  EXPECT_DOUBLE_EQ(Converted(2, "N m s", "N m s/rad"), 2);
  EXPECT_THAT(Refusal("rpm", "1/min"), HasSubstr("one counts cycles, the other angles"));
}

}  // namespace
}  // namespace polyest::internal
