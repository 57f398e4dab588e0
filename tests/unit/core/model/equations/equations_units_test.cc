// Tests units of equations: which go together, which do not, and which are not known.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/core/model/equations/equations.h"

namespace polyest::internal::equations_units_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Makes an output y with that text. The units are m for x, m/s for v, N for F, kg for m, rad for
// angle, deg for turn, mm for w; that of z is unknown.
EquationSpecification Output(const std::string& text, const std::string& unit) {
  EquationSpecification equations = {
      .outputs = {{"y", text}},
      .parameters = {{"x", 1}, {"v", 1}, {"F", 1}, {"m", 1}, {"angle", 1}, {"turn", 1}, {"w", 1}},
      .units = {{"x", "m"},
                {"v", "m/s"},
                {"F", "N"},
                {"m", "kg"},
                {"angle", "rad"},
                {"turn", "deg"},
                {"w", "mm"}}};
  if (!unit.empty()) equations.units["y"] = unit;
  return equations;
}

TEST(EquationUnits, GoTogether) {
  const char* const good[][2] = {{"F/m", "m/s^2"},
                                 {"x + 2*x", "m"},
                                 {"x + 0", "m"},
                                 {"-x", "m"},
                                 {"sqrt(x^2 + x*x)", "m"},
                                 {"x^1.5/sqrt(x)", "m"},
                                 {"m*v^2/2", "J"},
                                 {"sin(angle)*x", "m"},
                                 {"exp(-x/x)", "1"},
                                 {"sign(v)*F", "N"},
                                 {"abs(x)*if(v > 0, F, 0)", "N m"},
                                 {"min(x, 0, 2*x)", "m"},
                                 {"hypot(x, x)", "m"},
                                 {"atan2(x, x)", "rad"},
                                 {"v*t", "m"},
                                 {"x > 0 && v < 0", "1"},
                                 {"x/t + v", "m/s"},
                                 {"mod(x, x)", "m"},
                                 {"floor(x)", "m"},
                                 {"pow(x, 2)", "m^2"},
                                 {"x^(1/2 + 1/2)", "m"},
                                 {"angle^m1", "rad"},
                                 {"z*x", "N"},
                                 {"sin(z) + z^x1", "1"},
                                 {"pi*x", "m"}};
  for (const auto& [text, unit] : good) {
    EXPECT_THAT(Messages(Output(text, unit)), IsEmpty()) << text;
  }
}

struct Mismatch {
  const char* text;
  const char* message;
};

TEST(EquationUnits, ThatDoNotGoTogetherAreRefusedWhereTheyMeet) {
  const Mismatch bad[] = {
      {"F + x", "column 3: a sum of different units: N and m (at \"+ x\")"},
      {"F - 2*x", "column 3: a difference of different units: N and m (at \"- 2*x\")"},
      {"x + 1", "column 3: a sum of different units: m and 1 (at \"+ 1\")"},
      {"x + w", "column 3: a sum of different scale: m and 0.001 m (at \"+ w\")"},
      {"x > v", "column 3: a comparison of different units: m and m/s (at \"> v\")"},
      {"x < 1", "column 3: a comparison of different units: m and 1 (at \"< 1\")"},
      {"min(x, v)",
       "column 1: the smaller or larger of different units: m and m/s (at \"min(x, "
       "v)\")"},
      {"if(v > 0, x, F)",
       "column 1: the two sides of if of different units: m and N (at \"if(v > "
       "0, x, F)\")"},
      {"hypot(x, v)", "column 1: hypot of different units: m and m/s (at \"hypot(x, v)\")"},
      {"sin(x)", "column 1: this function needs a plain number, not one in m (at \"sin(x)\")"},
      {"x*tanh(v)",
       "column 3: this function needs a plain number, not one in m/s (at \"tanh(v)\")"},
      {"x^z", "column 2: a power of something in m needs a constant exponent (at \"^z\")"},
      {"2^x", "column 2: the exponent has the unit m; it must be a plain number (at \"^x\")"},
  };
  for (const Mismatch& mismatch : bad) {
    EXPECT_THAT(Messages(Output(mismatch.text, "")),
                ElementsAre(std::string("model.equations.outputs.y: ") + mismatch.message));
  }
  EXPECT_THAT(Messages(Output("sin(turn)", "")), ElementsAre(HasSubstr("give angles in rad")));
}

TEST(EquationUnits, OfAnExpressionAreThoseOfItsName) {
  EXPECT_THAT(Messages(Output("F/m", "m/s")),
              ElementsAre("model.equations.outputs.y: the expression has the unit m/s^2; it must "
                          "have m/s"));
  EXPECT_THAT(
      Messages({.states = {{"x", "v"}, {"v", "-k*x"}},
                .outputs = {{"y", "x"}},
                .units = {{"x", "m"}, {"v", "m/s"}, {"k", "N/m"}}}),
      ElementsAre("model.equations.states.v: the expression has the unit N; it must have m/s^2, "
                  "that of v per s"));
  EXPECT_THAT(Messages({.outputs = {{"y", "a + x"}},
                        .intermediates = {{"a", "2*F"}},
                        .units = {{"x", "m"}, {"F", "N"}}}),
              ElementsAre(HasSubstr("a sum of different units: N and m")));
}

TEST(EquationUnits, OfTheTimeAreSecondsIfAnyAreGiven) {
  EXPECT_THAT(Messages({.outputs = {{"y", "sin(t)"}}}), IsEmpty());
  EXPECT_THAT(Messages({.outputs = {{"y", "sin(w*t)*a"}}, .units = {{"w", "rad/s"}}}), IsEmpty());
  EXPECT_THAT(Messages({.outputs = {{"y", "sin(t)*a"}}, .units = {{"a", "m"}}}),
              ElementsAre(HasSubstr("needs a plain number, not one in s")));
}

TEST(EquationUnits, OfAnInitialValueAreThoseOfItsState) {
  EXPECT_THAT(
      Messages(
          {.states = {{"x", "1"}}, .outputs = {{"y", "x"}}, .units = {{"x_0", "mm"}, {"x", "m"}}}),
      testing::Contains("model.equations.units.x_0: is \"mm\"; it must be that of its state "
                        "x, \"m\""));
}

TEST(EquationUnits, AreOfNamesThatThereAre) {
  EXPECT_THAT(Messages({.outputs = {{"y", "k"}}, .units = {{"kk", "N"}}}),
              ElementsAre("model.equations.units: \"kk\" is not a name in these equations"));
  EXPECT_THAT(Messages({.outputs = {{"y", "k"}}, .units = {{"k", "Nm"}}}),
              ElementsAre(HasSubstr(
                  "model.equations.units.k: the unit \"Nm\" has the unknown symbol \"Nm\"")));
}

// The expression that cannot be read may have the name.
TEST(EquationUnits, AreNotRefusedBesideAnExpressionThatCannotBeRead) {
  EXPECT_THAT(Messages({.outputs = {{"y", "k +"}, {"z", "1"}}, .units = {{"k", "N/m"}}}),
              ElementsAre(HasSubstr("model.equations.outputs.y: column 4: expected a number")));
}

TEST(EquationUnits, OfOutputsFollowFromTheirExpressions) {
  const auto unit = [](const std::string& text) {
    const auto model = MakeOrFail(Output(text, ""));
    return model == nullptr ? "" : model->description().outputs[0].unit;
  };
  EXPECT_EQ(unit("F"), "N");
  EXPECT_EQ(unit("m*v/t"), "N");
  EXPECT_EQ(unit("m*v^2"), "kg m^2/s^2");
  EXPECT_EQ(unit("v/x"), "1/s");
  EXPECT_EQ(unit("z*x"), "");
  EXPECT_EQ(unit("turn"), "deg");
}

}  // namespace
}  // namespace polyest::internal::equations_units_test
