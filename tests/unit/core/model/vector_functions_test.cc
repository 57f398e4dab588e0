// Compares the functions of lanes with the C library's: their values in long double, and what they
// give for zeros, infinities, NaN and huge arguments.

#include "core/model/vector_functions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace polyest::internal {
namespace {

using LongDouble = long double;

struct OfOne {
  const char* name;
  Lane (*lanes)(const Lane&);
  double (*scalar)(double);
  LongDouble (*exact)(LongDouble);
  double lower, upper;
};

const OfOne kOfOne[] = {
    {"sin", Sin, std::sin, sinl, -50, 50},       {"cos", Cos, std::cos, cosl, -50, 50},
    {"sin", Sin, std::sin, sinl, 1e4, 1e6},      {"cos", Cos, std::cos, cosl, 1e4, 1e6},
    {"tan", Tan, std::tan, tanl, -30, 30},       {"asin", Asin, std::asin, asinl, -1, 1},
    {"acos", Acos, std::acos, acosl, -1, 1},     {"atan", Atan, std::atan, atanl, -20, 20},
    {"sinh", Sinh, std::sinh, sinhl, -9, 9},     {"cosh", Cosh, std::cosh, coshl, -9, 9},
    {"expm1", Expm1, std::expm1, expm1l, -1, 1}, {"expm1", Expm1, std::expm1, expm1l, -40, 40},
    {"log", Log, std::log, logl, 0.5, 2},        {"log", Log, std::log, logl, 1e-3, 1e3},
    {"log10", Log10, std::log10, log10l, 0.5, 2}};

struct OfTwo {
  const char* name;
  Lane (*lanes)(const Lane&, const Lane&);
  double (*scalar)(double, double);
  LongDouble (*exact)(LongDouble, LongDouble);
  double lower, upper;
};

const OfTwo kOfTwo[] = {{"atan2", Atan2, std::atan2, atan2l, -3, 3},
                        {"hypot", Hypot, std::hypot, hypotl, -3, 3},
                        {"pow", Pow, std::pow, powl, 0.01, 10}};

// Expects a value within 4 units in the last place of the exact one.
void ExpectAccurate(const char* name, double value, LongDouble exact, double x, double y = 0) {
  const double rounded = std::abs(static_cast<double>(exact));
  const double unit = std::nextafter(rounded, INFINITY) - rounded;
  EXPECT_LT(std::abs(static_cast<double>(value - exact)), 4 * unit)
      << name << " of " << x << ", " << y;
}

// Returns `count` numbers that fill an interval without a pattern.
std::vector<double> Spread(double lower, double upper, int count, double step) {
  std::vector<double> numbers;
  for (int i = 0; i < count; ++i) {
    numbers.push_back(lower + (upper - lower) * std::fmod(step * (i + 0.5), 1));
  }
  return numbers;
}

TEST(VectorFunctions, AreAccurateToFourUnitsInTheLastPlace) {
  constexpr int kCount = 4000;
  for (const OfOne& function : kOfOne) {
    for (const double x : Spread(function.lower, function.upper, kCount, 0.6180339887)) {
      const double value = function.lanes(Lane::Constant(x))[0];
      ExpectAccurate(function.name, value, function.exact(x), x);
    }
  }
  for (const OfTwo& function : kOfTwo) {
    const std::vector<double> y = Spread(-3, 3, kCount, 0.7548776662);
    const std::vector<double> x = Spread(function.lower, function.upper, kCount, 0.5698402910);
    for (size_t i = 0; i < x.size(); ++i) {
      const double value = function.lanes(Lane::Constant(x[i]), Lane::Constant(y[i]))[0];
      ExpectAccurate(function.name, value, function.exact(x[i], y[i]), x[i], y[i]);
    }
  }
}

const double kSpecial[] = {0.0,   -0.0,   1.0,  -1.0,     2.0,       -3.0, 0.5, 1e-310, -1e-310,
                           1e300, -1e300, 1e22, INFINITY, -INFINITY, NAN,  800, -800,   1e-8};

// Expects the same as from the C library, up to rounding.
void ExpectSame(const char* name, double value, double expected, double x, double y = 0) {
  if (std::isnan(expected)) {
    EXPECT_TRUE(std::isnan(value)) << name << " of " << x << ", " << y << " is " << value;
  } else if (expected == 0 || std::isinf(expected)) {
    EXPECT_EQ(value, expected) << name << " of " << x << ", " << y;
  } else {
    EXPECT_NEAR(value, expected, 1e-15 * std::abs(expected)) << name << " of " << x << ", " << y;
  }
}

TEST(VectorFunctions, GiveWhatTheScalarOnesGiveForSpecialArguments) {
  for (const double x : kSpecial) {
    for (const OfOne& function : kOfOne) {
      ExpectSame(function.name, function.lanes(Lane::Constant(x))[1], function.scalar(x), x);
    }
    for (const double y : kSpecial) {
      for (const OfTwo& function : kOfTwo) {
        const double value = function.lanes(Lane::Constant(x), Lane::Constant(y))[1];
        ExpectSame(function.name, value, function.scalar(x, y), x, y);
      }
    }
  }
}

// Sqrt must be the root that IEEE 754 asks for.
TEST(VectorFunctions, HaveExactRoots) {
  for (const double x : Spread(1e-3, 1e3, 4000, 0.6180339887)) {
    EXPECT_EQ(Sqrt(Lane(Lane::Constant(x)))[5], std::sqrt(x)) << x;
  }
  for (const double x : kSpecial) {
    ExpectSame("sqrt", Sqrt(Lane(Lane::Constant(x)))[5], std::sqrt(x), x);
  }
}

// Two roundings and expm1's error make less than six units. There is no friction at all at rest,
// and as much in either direction.
TEST(VectorFunctions, HaveAHyperbolicTangent) {
  std::vector<double> arguments = Spread(0, 20, 4000, 0.6180339887);
  arguments.insert(arguments.end(), {1e-300, 1e-20, 1e-8, 1e-3, 0.1, 1e300});
  for (const double x : arguments) {
    const double value = HyperbolicTangent(Lane(Lane::Constant(x)))[2];
    EXPECT_NEAR(value, std::tanh(x), 1.4e-15 * std::tanh(x)) << x;
    EXPECT_EQ(HyperbolicTangent(Lane(Lane::Constant(-x)))[7], -value) << x;
  }
  for (const double x : kSpecial) {
    ExpectSame("tanh", HyperbolicTangent(Lane(Lane::Constant(x)))[1], std::tanh(x), x);
  }
}

// The neighbours of a point may be those for which libmvec calls the scalar functions.
TEST(VectorFunctions, GiveAPointTheSameBitsInAnyLane) {
  for (const OfOne& function : kOfOne) {
    const Lane x = {0.3, 1e22, 0.7, NAN, 2.0, INFINITY, 1e-310, -5.0};
    const Lane values = function.lanes(x);
    for (int i = 0; i < kLanes; ++i) {
      const double alone = function.lanes(Lane::Constant(x[i]))[(i + 3) % kLanes];
      EXPECT_TRUE(values[i] == alone || (std::isnan(values[i]) && std::isnan(alone)))
          << function.name << " of " << x[i];
    }
  }
}

}  // namespace
}  // namespace polyest::internal
