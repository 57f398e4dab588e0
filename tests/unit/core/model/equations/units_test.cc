#include "core/model/units.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

Unit Parse(const std::string& text) {
  const auto unit = ParseUnit(text);
  EXPECT_TRUE(unit.ok()) << unit.status();
  return unit.value_or(Unit{});
}

TEST(Units, ThatMeanTheSameAreEqual) {
  const char* const equal[][2] = {{"N", "kg m/s^2"},
                                  {"N/m", "kg/s^2"},
                                  {"N s/m", "N*s/m"},
                                  {"m/s/s", "m/s^2"},
                                  {"J/(kg K)", "m^2/s^2/K"},
                                  {"rad/s", "1/s"},
                                  {"Hz", "s^-1"},
                                  {"Pa", "N/m^2"},
                                  {"V", "W/A"},
                                  {"kN", "1000 N"},
                                  {"mm", "0.001 m"},
                                  {"km/h", "1000 m/3600/s"},
                                  {"deg", "0.017453292519943295 rad"},
                                  {"N m", "J"},
                                  {"kg·m²", "kg m^2"},
                                  {"N/m³", "N/m^3"},
                                  {"µm", "um"},
                                  {"t", "1000 kg"},
                                  {"min", "60 s"},
                                  {"m^0.5 m^0.5", "m"},
                                  {"Ohm", "Ω"},
                                  {"g", "0.001 kg"},
                                  {"1", "rad"},
                                  {"T", "kg/A/s^2"},
                                  {"daN", "10 N"},
                                  {"l", "dm^3"},
                                  {"°", "deg"},
                                  {"mgn", "9.80665 mm/s^2"},
                                  {"lbf", "lb gn"},
                                  {"psi", "lbf/in^2"},
                                  {"kgf", "kg gn"},
                                  {"mph", "5280 ft/h"},
                                  {"(m/s)^2", "m^2/s^2"}};
  for (const auto& [a, b] : equal) EXPECT_TRUE(SameUnit(Parse(a), Parse(b))) << a << ", " << b;
}

TEST(Units, ThatDifferInScaleHaveTheSameDimensionOnly) {
  EXPECT_FALSE(SameUnit(Parse("mm"), Parse("m")));
  EXPECT_TRUE(SameDimension(Parse("mm"), Parse("m")));
  EXPECT_FALSE(SameUnit(Parse("deg"), Parse("rad")));
  EXPECT_FALSE(SameDimension(Parse("s"), Parse("m")));
  EXPECT_TRUE(Parse("1").IsPlain());
  EXPECT_TRUE(Parse("rad").IsPlain());
  EXPECT_FALSE(Parse("deg").IsPlain());
}

TEST(Units, AreWrittenInAWayThatReadsAsTheSame) {
  EXPECT_EQ(FormatUnit(Parse("kg m/s^2")), "N");
  EXPECT_EQ(FormatUnit(Parse("N/m")), "kg/s^2");
  EXPECT_EQ(FormatUnit(Parse("m/s")), "m/s");
  EXPECT_EQ(FormatUnit(Parse("Hz")), "1/s");
  EXPECT_EQ(FormatUnit(Parse("rad")), "1");
  for (const char* text :
       {"N", "mm/s", "kN m", "1/s", "N/m^3", "m^0.5", "deg", "Ohm", "mol/l", "V s"}) {
    EXPECT_TRUE(SameUnit(Parse(FormatUnit(Parse(text))), Parse(text))) << text;
  }
}

TEST(Units, KeepTheirPowersWhenTheyAreWritten) {
  for (const double power : {1.0 / 3, 2.0 / 3, 1.0 / 7, -5.0 / 3, 31 + 1.0 / 3, 0.1 + 0.2}) {
    for (const char* base : {"m", "kN s", "mol/l"}) {
      const Unit unit = Power(Parse(base), power);
      EXPECT_TRUE(SameUnit(Parse(FormatUnit(unit)), unit)) << FormatUnit(unit);
    }
  }
  EXPECT_EQ(FormatUnit(Parse("m^0.5")), "m^0.5");
  EXPECT_EQ(FormatUnit(Parse("kg^2.5/s^12")), "kg^2.5/s^12");
}

TEST(Units, MayHavePowersWithoutASign) {
  for (const auto& [text, unit] : {std::pair{"m/s2", "m/s^2"},
                                   {"kg m2/s2", "J"},
                                   {"s-1", "1/s"},
                                   {"m s-2", "m/s^2"},
                                   {"m·s⁻²", "m/s^2"},
                                   {"(m/s)2", "m^2/s^2"},
                                   {"N/mm2", "MPa"}}) {
    EXPECT_TRUE(SameUnit(Parse(text), Parse(unit))) << text;
  }
  for (const char* const text : {"m1", "m10", "m-", "m2a", "2-1", "-2", "acc2", "m2.5"}) {
    EXPECT_FALSE(ParseUnit(text).ok()) << text;
  }
}

TEST(Units, ThatAreNoneAreRefusedInWords) {
  const auto error = [](const std::string& text) {
    return std::string(ParseUnit(text).status().message());
  };
  EXPECT_THAT(error("Nm"), HasSubstr("the unit \"Nm\" has the unknown symbol \"Nm\"; the symbols "
                                     "are m, g, s, A, K, mol, cd, rad, sr, Hz, N, Pa"));
  EXPECT_THAT(error("foo/m"), HasSubstr("has the unknown symbol \"foo\""));
  EXPECT_EQ(error(""), "the unit \"\" lacks a symbol; the unit of a plain number is 1");
  EXPECT_EQ(error("m/"), "the unit \"m/\" lacks a symbol; the unit of a plain number is 1");
  EXPECT_EQ(error("m^"), "the unit \"m^\" has a ^ without a number between -100 and 100 after it");
  EXPECT_EQ(error("m^1e3"),
            "the unit \"m^1e3\" has a ^ without a number between -100 and 100 after it");
  EXPECT_EQ(error("(m"), "the unit \"(m\" has a ( without its )");
  EXPECT_EQ(error("m)"), "the unit \"m)\" has a ) without its (");
  EXPECT_EQ(error("0"), "the unit \"0\" has a number that is not positive");
  EXPECT_THAT(error(std::string(201, 'm')), HasSubstr("is too long"));
  EXPECT_THAT(error(std::string(20, '(')), HasSubstr("nested too deep"));
  EXPECT_THAT(error("1e300 1e300"), HasSubstr("out of range"));
  EXPECT_FALSE(ParseUnit("\xff").ok());
}

}  // namespace
}  // namespace polyest::internal
