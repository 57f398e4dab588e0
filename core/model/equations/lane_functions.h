#pragma once

// Each operation applied to kLanes points. Where Eigen has no vector instruction, the standard
// library's function is applied point by point. A point therefore gets the same bits in any lane.

#include <cmath>
#include <functional>

#include "core/model/equations/operation.h"
#include "core/model/lane.h"

namespace polyest::internal::equations {

template <Operation operation>
struct LaneFunction;

#define POLYEST_UNARY(operation, expression)                \
  template <>                                               \
  struct LaneFunction<Operation::operation> {               \
    static Lane Apply(const Lane& a) { return expression; } \
  };
#define POLYEST_BINARY(operation, expression)                              \
  template <>                                                              \
  struct LaneFunction<Operation::operation> {                              \
    static Lane Apply(const Lane& a, const Lane& b) { return expression; } \
  };
#define POLYEST_TERNARY(operation, expression)                                            \
  template <>                                                                             \
  struct LaneFunction<Operation::operation> {                                             \
    static Lane Apply(const Lane& a, const Lane& b, const Lane& c) { return expression; } \
  };

template <double (*function)(double)>
Lane PointByPoint(const Lane& a) {
  Lane result;
  for (int i = 0; i < kLanes; ++i) result[i] = function(a[i]);
  return result;
}

template <double (*function)(double, double)>
Lane PointByPoint(const Lane& a, const Lane& b) {
  Lane result;
  for (int i = 0; i < kLanes; ++i) result[i] = function(a[i], b[i]);
  return result;
}

// Returns 1 where the relation holds and 0 elsewhere. Plain loops are used because the compiler
// vectorizes them with masks, unlike Eigen's select().
template <class Relation>
Lane Truth(const Lane& a, const Lane& b, Relation relation) {
  Lane result;
  for (int i = 0; i < kLanes; ++i) result[i] = relation(a[i], b[i]) ? 1.0 : 0.0;
  return result;
}

// Returns a where the condition is not 0, else b. Nothing of the other side enters the result, not
// even a NaN.
inline Lane Select(const Lane& condition, const Lane& a, const Lane& b) {
  Lane result;
  for (int i = 0; i < kLanes; ++i) result[i] = condition[i] != 0 ? a[i] : b[i];
  return result;
}

// Returns NaN if either operand is NaN.
inline Lane Minimum(const Lane& a, const Lane& b) {
  Lane result;
  for (int i = 0; i < kLanes; ++i) result[i] = a[i] < b[i] || a[i] != a[i] ? a[i] : b[i];
  return result;
}

inline Lane Maximum(const Lane& a, const Lane& b) {
  Lane result;
  for (int i = 0; i < kLanes; ++i) result[i] = a[i] > b[i] || a[i] != a[i] ? a[i] : b[i];
  return result;
}

// For |x| < 0.625 evaluates Lambert's continued fraction x/(1 + x²/(3 + x²/(5 + …))) truncated
// after 17, with an error of |x|¹⁷/(17·15!!²) < 1e-17 |x|. Otherwise evaluates (e^{2|x|} −
// 1)/(e^{2|x|} + 1) with the sign of x, which rounds to 1 beyond 20.
inline Lane HyperbolicTangent(const Lane& x) {
  const Lane s = x * x;
  const Lane near_numerator = x * ((((s + 990) * s + 135135) * s + 4729725) * s + 34459425);
  const Lane near_denominator = (((45 * s + 13860) * s + 945945) * s + 16216200) * s + 34459425;
  const Lane size = x.abs();
  const Lane power = (2 * Minimum(size, Lane::Constant(20))).exp();
  Lane numerator, denominator;
  for (int i = 0; i < kLanes; ++i) {
    const double far = x[i] < 0 ? 1 - power[i] : power[i] - 1;
    numerator[i] = size[i] < 0.625 ? near_numerator[i] : far;
    denominator[i] = size[i] < 0.625 ? near_denominator[i] : power[i] + 1;
  }
  return numerator / denominator;
}

// Returns −1, 0 or 1, and NaN for NaN.
inline Lane Sign(const Lane& x) {
  Lane result;
  for (int i = 0; i < kLanes; ++i) result[i] = x[i] > 0 ? 1.0 : x[i] < 0 ? -1.0 : x[i];
  return result;
}

// Returns the remainder of the division that rounds down; it has the sign of the divisor.
inline double Modulo(double a, double b) {
  const double remainder = std::fmod(a, b);
  return remainder != 0 && (remainder < 0) != (b < 0) ? remainder + b : remainder;
}

POLYEST_UNARY(kNegate, -a)
POLYEST_UNARY(kNot, Truth(a, Lane::Zero(), std::equal_to<>()))
POLYEST_UNARY(kAbsolute, a.abs())
POLYEST_UNARY(kSign, Sign(a))
POLYEST_UNARY(kSquareRoot, Sqrt(a))
POLYEST_UNARY(kExponential, a.exp())
POLYEST_UNARY(kLogarithm, PointByPoint<std::log>(a))
POLYEST_UNARY(kLogarithm10, PointByPoint<std::log10>(a))
POLYEST_UNARY(kSine, PointByPoint<std::sin>(a))
POLYEST_UNARY(kCosine, PointByPoint<std::cos>(a))
POLYEST_UNARY(kTangent, PointByPoint<std::tan>(a))
POLYEST_UNARY(kArcSine, PointByPoint<std::asin>(a))
POLYEST_UNARY(kArcCosine, PointByPoint<std::acos>(a))
POLYEST_UNARY(kArcTangent, PointByPoint<std::atan>(a))
POLYEST_UNARY(kHyperbolicSine, PointByPoint<std::sinh>(a))
POLYEST_UNARY(kHyperbolicCosine, PointByPoint<std::cosh>(a))
POLYEST_UNARY(kHyperbolicTangent, HyperbolicTangent(a))
POLYEST_UNARY(kFloor, a.floor())
POLYEST_UNARY(kCeiling, a.ceil())

POLYEST_BINARY(kAdd, a + b)
POLYEST_BINARY(kSubtract, a - b)
POLYEST_BINARY(kMultiply, a* b)
POLYEST_BINARY(kDivide, a / b)
POLYEST_BINARY(kPower, PointByPoint<std::pow>(a, b))
POLYEST_BINARY(kMinimum, Minimum(a, b))
POLYEST_BINARY(kMaximum, Maximum(a, b))
POLYEST_BINARY(kArcTangent2, PointByPoint<std::atan2>(a, b))
POLYEST_BINARY(kHypotenuse, PointByPoint<std::hypot>(a, b))
POLYEST_BINARY(kModulo, PointByPoint<Modulo>(a, b))
POLYEST_BINARY(kLess, Truth(a, b, std::less<>()))
POLYEST_BINARY(kLessOrEqual, Truth(a, b, std::less_equal<>()))
POLYEST_BINARY(kEqual, Truth(a, b, std::equal_to<>()))
POLYEST_BINARY(kNotEqual, Truth(a, b, std::not_equal_to<>()))
POLYEST_BINARY(kAnd, Truth(a, b, [](double p, double q) { return p != 0 && q != 0; }))
POLYEST_BINARY(kOr, Truth(a, b, [](double p, double q) { return p != 0 || q != 0; }))

POLYEST_TERNARY(kSelect, Select(a, b, c))
POLYEST_TERNARY(kMultiplyAdd, a* b + c)
POLYEST_TERNARY(kMultiplySubtract, a* b - c)
POLYEST_TERNARY(kSubtractMultiplied, c - a * b)

#undef POLYEST_UNARY
#undef POLYEST_BINARY
#undef POLYEST_TERNARY

}  // namespace polyest::internal::equations
