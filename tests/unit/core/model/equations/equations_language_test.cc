// Tests the meaning of the language: precedence, every function against the standard library's,
// piecewise expressions, NaN, and derivatives of everything.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/unit/core/model/equations/equations.h"

namespace polyest::internal {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Evaluates a model with the states a, b, c and with dc/dt the expression, at many points: its
// values and its derivatives with respect to a, b and c.
class Expression {
 public:
  explicit Expression(const std::string& text)
      : model_(MakeOrFail(
            {.states = {{"a", "0"}, {"b", "0"}, {"c", text}}, .outputs = {{"y", text}}})) {}

  Eigen::ArrayXd Values(const Eigen::ArrayXXd& states) const {
    Eigen::ArrayXXd derivatives(states.rows(), 3);
    model_->Derivatives(0, states, Parameters(states), none_, derivatives);
    return derivatives.col(2);
  }

  // Returns the slopes; column s is with respect to state s.
  Eigen::ArrayXXd Slopes(const Eigen::ArrayXXd& states) const {
    Eigen::ArrayXXd jacobian(states.rows(), 9), slopes(states.rows(), 3);
    model_->StateJacobian(0, states, Parameters(states), none_, jacobian);
    for (int s = 0; s < 3; ++s) {
      slopes.col(s) = jacobian.col(3 * s + 2);
      EXPECT_TRUE((jacobian.middleCols(3 * s, 2) == 0).all());
    }
    return slopes;
  }

  double At(double a, double b = 0, double c = 0) const {
    return Values(Points({a, b, c}))[kLanes - 1];
  }
  double SlopeAt(int s, double a, double b = 0, double c = 0) const {
    return Slopes(Points({a, b, c}))(kLanes - 1, s);
  }

 private:
  static Eigen::ArrayXXd Points(const Eigen::Array3d& point) {
    return point.transpose().replicate(kLanes, 1);
  }
  static Eigen::ArrayXXd Parameters(const Eigen::ArrayXXd& states) {
    return Eigen::ArrayXXd::Zero(states.rows(), 3);
  }

  std::shared_ptr<const StateSpaceModel> model_;
  Eigen::ArrayXXd none_{0, 0};
};

double Value(const std::string& text, double a = 0, double b = 0, double c = 0) {
  return Expression(text).At(a, b, c);
}

TEST(EquationLanguage, BindsOperatorsAsMathematicsDoes) {
  EXPECT_EQ(Value("2 + 3*4"), 14);
  EXPECT_EQ(Value("2*3 + 4"), 10);
  EXPECT_EQ(Value("(2 + 3)*4"), 20);
  EXPECT_EQ(Value("10 - 4 - 3"), 3);
  EXPECT_EQ(Value("a/b/c", 16, 4, 2), 2);
  EXPECT_EQ(Value("a/b*c", 16, 4, 2), 8);
  EXPECT_EQ(Value("2^3^2"), 512);
  EXPECT_EQ(Value("-a^2", 3), -9);
  EXPECT_EQ(Value("(-a)^2", 3), 9);
  EXPECT_EQ(Value("2^-a", 1), 0.5);
  EXPECT_EQ(Value("2^-a^2", 2), 0.0625);
  EXPECT_EQ(Value("-a*b", 3, 2), -6);
  EXPECT_EQ(Value("a*-b", 3, 2), -6);
  EXPECT_EQ(Value("a - -b", 3, 2), 5);
  EXPECT_EQ(Value("+a", 3), 3);
  EXPECT_EQ(Value("2*a^2", 3), 18);
}

TEST(EquationLanguage, BindsComparisonsLooserThanSumsAndLogicLooserStill) {
  EXPECT_EQ(Value("a + 1 < b", 1, 3), 1);
  EXPECT_EQ(Value("a < b && b < c", 1, 2, 3), 1);
  EXPECT_EQ(Value("a < b && b < c", 1, 2, 2), 0);
  EXPECT_EQ(Value("1 || a && 0", 1), 1);
  EXPECT_EQ(Value("(1 || a) && 0", 1), 0);
  EXPECT_EQ(Value("!a < b", 5, 1), 1);
  EXPECT_EQ(Value("!(a < b)", 5, 1), 1);
  EXPECT_EQ(Value("!!a", 5), 1);
  EXPECT_EQ(Value("2*(a > 1)", 5), 2);
}

TEST(EquationLanguage, ComparesAsTheProcessorDoes) {
  for (const double a : {-1.0, 0.0, 1.0, kNaN, kInfinity}) {
    for (const double b : {-1.0, 0.0, 1.0, kNaN, kInfinity}) {
      EXPECT_EQ(Value("a < b", a, b), a < b);
      EXPECT_EQ(Value("a <= b", a, b), a <= b);
      EXPECT_EQ(Value("a > b", a, b), a > b);
      EXPECT_EQ(Value("a >= b", a, b), a >= b);
      EXPECT_EQ(Value("a == b", a, b), a == b);
      EXPECT_EQ(Value("a != b", a, b), a != b);
      EXPECT_EQ(Value("a && b", a, b), a != 0 && b != 0);
      EXPECT_EQ(Value("a || b", a, b), a != 0 || b != 0);
    }
  }
}

TEST(EquationLanguage, ReadsNumbersAndNames) {
  EXPECT_EQ(Value("1.5e-3"), 1.5e-3);
  EXPECT_EQ(Value("2E+2"), 200);
  EXPECT_EQ(Value(".5 + 1."), 1.5);
  EXPECT_EQ(Value("pi"), M_PI);
  EXPECT_EQ(Value(" \t a\n*\r b ", 2, 3), 6);
}

struct UnaryFunction {
  const char* name;
  std::function<double(double)> value;
  std::function<double(double)> slope;
  double lower, upper;
};

const UnaryFunction kUnaryFunctions[] = {
    {"sin", [](double x) { return std::sin(x); }, [](double x) { return std::cos(x); }, -50, 50},
    {"cos", [](double x) { return std::cos(x); }, [](double x) { return -std::sin(x); }, -50, 50},
    {"tan", [](double x) { return std::tan(x); },
     [](double x) { return 1 / (std::cos(x) * std::cos(x)); }, -1.5, 1.5},
    {"asin", [](double x) { return std::asin(x); },
     [](double x) { return 1 / std::sqrt((1 - x) * (1 + x)); }, -0.9, 0.9},
    {"acos", [](double x) { return std::acos(x); },
     [](double x) { return -1 / std::sqrt((1 - x) * (1 + x)); }, -0.9, 0.9},
    {"atan", [](double x) { return std::atan(x); }, [](double x) { return 1 / (1 + x * x); }, -20,
     20},
    {"sinh", [](double x) { return std::sinh(x); }, [](double x) { return std::cosh(x); }, -9, 9},
    {"cosh", [](double x) { return std::cosh(x); }, [](double x) { return std::sinh(x); }, -9, 9},
    {"tanh", [](double x) { return std::tanh(x); },
     [](double x) { return 1 - std::tanh(x) * std::tanh(x); }, -3, 3},
    {"exp", [](double x) { return std::exp(x); }, [](double x) { return std::exp(x); }, -600, 600},
    {"log", [](double x) { return std::log(x); }, [](double x) { return 1 / x; }, 1e-3, 1e3},
    {"log10", [](double x) { return std::log10(x); },
     [](double x) { return 1 / (x * std::log(10.0)); }, 1e-3, 1e3},
    {"sqrt", [](double x) { return std::sqrt(x); }, [](double x) { return 0.5 / std::sqrt(x); },
     1e-3, 1e3},
    {"abs", [](double x) { return std::abs(x); }, [](double x) { return x < 0 ? -1 : 1; }, -3, 3},
    {"sign", [](double x) { return x < 0 ? -1.0 : 1.0; }, [](double) { return 0.0; }, -3, 3},
    {"floor", [](double x) { return std::floor(x); }, [](double) { return 0.0; }, -9, 9},
    {"ceil", [](double x) { return std::ceil(x); }, [](double) { return 0.0; }, -9, 9},
};

// The bound is a few units in the last place: four for libmvec's functions and one for those of the
// standard library that they are compared with, two for Eigen's exp, five for the tanh, which is a
// quotient of libmvec's expm1, and some more for the formulas of the slopes, in which 1 − x² loses
// up to a digit.
TEST(EquationLanguage, HasTheFunctionsOfTheStandardLibraryAndTheirDerivatives) {
  constexpr Eigen::Index kPoints = 800;
  for (const UnaryFunction& function : kUnaryFunctions) {
    const Expression expression(std::string(function.name) + "(a)");
    Eigen::ArrayXXd states = Eigen::ArrayXXd::Zero(kPoints, 3);
    states.col(0) = Eigen::ArrayXd::LinSpaced(kPoints, function.lower, function.upper);
    const Eigen::ArrayXd values = expression.Values(states);
    const Eigen::ArrayXXd slopes = expression.Slopes(states);
    for (Eigen::Index i = 0; i < kPoints; ++i) {
      const double x = states(i, 0);
      const double value = function.value(x), slope = function.slope(x);
      ASSERT_NEAR(values[i], value, 1.1e-15 * std::abs(value)) << function.name << "(" << x << ")";
      ASSERT_NEAR(slopes(i, 0), slope, 1e-14 * std::max(1.0, std::abs(slope)))
          << "slope of " << function.name << "(" << x << ")";
      ASSERT_EQ(slopes(i, 1), 0);
    }
  }
}

TEST(EquationLanguage, HasAHyperbolicTangentThatIsExactNearZeroAndFarAway) {
  const Expression tanh("tanh(a)");
  for (const double x : {1e-300, 1e-20, 1e-8, 1e-3, 0.1, 0.5, 0.6249999, 0.625, 0.63, 1.0, 2.0, 5.0,
                         18.0, 19.0, 20.0, 30.0, 1e300}) {
    EXPECT_NEAR(tanh.At(x), std::tanh(x), 1.1e-15 * std::tanh(x)) << x;
    EXPECT_EQ(tanh.At(-x), -tanh.At(x)) << x;
  }
  EXPECT_EQ(tanh.At(0), 0);
  EXPECT_EQ(tanh.At(kInfinity), 1);
  EXPECT_EQ(tanh.At(-kInfinity), -1);
  EXPECT_TRUE(std::isnan(tanh.At(kNaN)));
}

TEST(EquationLanguage, OverflowsToInfinityAndNotToALargeNumber) {
  EXPECT_EQ(Value("exp(a)", 1000), kInfinity);
  EXPECT_NEAR(Value("exp(a)", -1000), 0, 1e-300);
  EXPECT_TRUE(std::isnan(Value("exp(a)", kNaN)));
  EXPECT_TRUE(std::isnan(Value("sqrt(a)", -1)));
  EXPECT_TRUE(std::isnan(Value("log(a)", -1)));
  EXPECT_EQ(Value("log(a)", 0), -kInfinity);
  EXPECT_EQ(Value("1/a", 0), kInfinity);
}

struct BinaryFunction {
  const char* text;
  std::function<double(double, double)> value, slope_a, slope_b;
};

const BinaryFunction kBinaryFunctions[] = {
    {"a + b", std::plus<>(), [](double, double) { return 1.0; },
     [](double, double) { return 1.0; }},
    {"a - b", std::minus<>(), [](double, double) { return 1.0; },
     [](double, double) { return -1.0; }},
    {"a * b", std::multiplies<>(), [](double, double b) { return b; },
     [](double a, double) { return a; }},
    {"a / b", std::divides<>(), [](double, double b) { return 1 / b; },
     [](double a, double b) { return -a / (b * b); }},
    {"(a*a)^b", [](double a, double b) { return std::pow(a * a, b); },
     [](double a, double b) { return 2 * a * b * std::pow(a * a, b - 1); },
     [](double a, double b) { return std::pow(a * a, b) * std::log(a * a); }},
    {"pow(a*a, b)", [](double a, double b) { return std::pow(a * a, b); },
     [](double a, double b) { return 2 * a * b * std::pow(a * a, b - 1); },
     [](double a, double b) { return std::pow(a * a, b) * std::log(a * a); }},
    {"atan2(a, b)", [](double a, double b) { return std::atan2(a, b); },
     [](double a, double b) { return b / (a * a + b * b); },
     [](double a, double b) { return -a / (a * a + b * b); }},
    {"hypot(a, b)", [](double a, double b) { return std::hypot(a, b); },
     [](double a, double b) { return a / std::hypot(a, b); },
     [](double a, double b) { return b / std::hypot(a, b); }},
    {"min(a, b)", [](double a, double b) { return std::min(a, b); },
     [](double a, double b) { return a < b ? 1.0 : 0.0; },
     [](double a, double b) { return a < b ? 0.0 : 1.0; }},
    {"max(a, b)", [](double a, double b) { return std::max(a, b); },
     [](double a, double b) { return a > b ? 1.0 : 0.0; },
     [](double a, double b) { return a > b ? 0.0 : 1.0; }},
    {"mod(a, b)", [](double a, double b) { return a - b * std::floor(a / b); },
     [](double, double) { return 1.0; }, [](double a, double b) { return -std::floor(a / b); }},
    {"if(a < b, a*b, a - b)", [](double a, double b) { return a < b ? a * b : a - b; },
     [](double a, double b) { return a < b ? b : 1.0; },
     [](double a, double b) { return a < b ? a : -1.0; }},
};

TEST(EquationLanguage, HasTheOperatorsAndFunctionsOfTwoArgumentsAndTheirDerivatives) {
  constexpr Eigen::Index kPoints = 800;
  const Eigen::ArrayXXd states = 3 * Varied(kPoints, 3, 0.5);
  for (const BinaryFunction& function : kBinaryFunctions) {
    const Expression expression(function.text);
    const Eigen::ArrayXd values = expression.Values(states);
    const Eigen::ArrayXXd slopes = expression.Slopes(states);
    for (Eigen::Index i = 0; i < kPoints; ++i) {
      const double a = states(i, 0), b = states(i, 1);
      const auto near = [](double result, double expected) {
        return std::abs(result - expected) <= 1e-13 * std::max(1.0, std::abs(expected));
      };
      ASSERT_PRED2(near, values[i], function.value(a, b)) << function.text << " " << a << " " << b;
      ASSERT_PRED2(near, slopes(i, 0), function.slope_a(a, b)) << function.text << a << " " << b;
      ASSERT_PRED2(near, slopes(i, 1), function.slope_b(a, b)) << function.text << a << " " << b;
    }
  }
}

TEST(EquationLanguage, MultipliesOutIntegerPowers) {
  for (const int n : {0, 1, 2, 3, 4, 5, 7, 8, 11, 16, 17, 40, -1, -2, -3, -16, -17}) {
    const std::string text = "a^" + std::to_string(n);
    for (const double a : {-1.3, 0.7, 2.0}) {
      const double power = std::pow(a, n);
      EXPECT_NEAR(Value(text, a), power, 2e-15 * std::abs(power)) << text << " at " << a;
      EXPECT_NEAR(Expression(text).SlopeAt(0, a), n * std::pow(a, n - 1),
                  4e-15 * std::abs(n * std::pow(a, n - 1)))
          << text << " at " << a;
    }
  }
  EXPECT_EQ(Value("a^0", 0), 1);
  EXPECT_EQ(Value("a^0.5", 2), std::sqrt(2.0));
}

TEST(EquationLanguage, KnowsThePowersOfZero) {
  EXPECT_EQ(Value("a^b", 0, 2), 0);
  EXPECT_EQ(Value("a^b", 0, 0), 1);
  EXPECT_EQ(Expression("a^b").SlopeAt(0, 0, 2), 0);
  EXPECT_EQ(Expression("a^b").SlopeAt(1, 0, 2), 0);
  EXPECT_EQ(Expression("hypot(a, b)").SlopeAt(0, 0, 0), 0);
}

TEST(EquationLanguage, TakesNothingFromTheSideOfAnIfThatIsNotTaken) {
  const Expression root("if(a > 0, sqrt(a)/b, 0)");
  EXPECT_EQ(root.At(4, 2), 1);
  EXPECT_EQ(root.At(-4, 2), 0);
  EXPECT_EQ(root.SlopeAt(0, -4, 2), 0);
  EXPECT_EQ(root.SlopeAt(0, 4, 2), 0.125);
  EXPECT_EQ(root.At(-4, 0), 0);
  EXPECT_EQ(root.SlopeAt(1, -4, 0), 0);
  const Expression scaled("c*if(a > 0, log(a), b^2)");
  EXPECT_EQ(scaled.At(-1, 3, 2), 18);
  EXPECT_EQ(scaled.SlopeAt(0, -1, 3, 2), 0);
  EXPECT_EQ(scaled.SlopeAt(1, -1, 3, 2), 12);
  EXPECT_EQ(scaled.SlopeAt(2, -1, 3, 2), 9);
}

TEST(EquationLanguage, ShowsThatAnArgumentIsNotANumber) {
  for (const char* text : {"min(a, b)", "max(a, b)", "min(b, a)", "max(b, a)", "sign(a)", "abs(a)",
                           "hypot(a, b)", "atan2(a, b)", "mod(a, b)", "floor(a)", "a^2"}) {
    EXPECT_TRUE(std::isnan(Value(text, kNaN, 1))) << text;
  }
}

TEST(EquationLanguage, TakesMoreThanTwoArgumentsForMinAndMax) {
  EXPECT_EQ(Value("min(a, b, c)", 3, 1, 2), 1);
  EXPECT_EQ(Value("max(a, b, c, 2.5)", 1, 2, 2), 2.5);
  EXPECT_EQ(Expression("max(a, b, c)").SlopeAt(2, 1, 2, 3), 1);
}

TEST(EquationLanguage, GivesARemainderTheSignOfTheDivisor) {
  EXPECT_EQ(Value("mod(a, b)", 7, 3), 1);
  EXPECT_EQ(Value("mod(a, b)", -7, 3), 2);
  EXPECT_EQ(Value("mod(a, b)", 7, -3), -2);
  EXPECT_EQ(Value("mod(a, b)", -7, -3), -1);
  EXPECT_EQ(Value("mod(a, b)", 6, 3), 0);
  EXPECT_EQ(Value("sign(a)", 0), 0);
  EXPECT_EQ(Value("sign(a)", -2), -1);
}

}  // namespace
}  // namespace polyest::internal
