#pragma once

// Each operation applied to kLanes points. A point gets the same bits in any lane.

#include <cmath>
#include <functional>

#include "core/model/equations/operation.h"
#include "core/model/lane.h"
#include "core/model/vector_functions.h"

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

// Returns NaN if either operand is NaN: a comparison with it is false.
inline Lane Minimum(const Lane& a, const Lane& b) {
  return ByPacks([](Pack x, Pack y) { return x == x ? (x < y ? x : y) : x; }, a, b);
}

inline Lane Maximum(const Lane& a, const Lane& b) {
  return ByPacks([](Pack x, Pack y) { return x == x ? (x > y ? x : y) : x; }, a, b);
}

// Returns −1, 0 or 1, and NaN for NaN.
inline Lane Sign(const Lane& x) {
  Lane result;
  for (int i = 0; i < kLanes; ++i) result[i] = x[i] > 0 ? 1.0 : x[i] < 0 ? -1.0 : x[i];
  return result;
}

// Returns the remainder of the division that rounds down; it has the sign of the divisor.
inline Lane Modulo(const Lane& a, const Lane& b) {
  Lane result;
  for (int i = 0; i < kLanes; ++i) {
    const double remainder = std::fmod(a[i], b[i]);
    const bool other_sign = remainder != 0 && (remainder < 0) != (b[i] < 0);
    result[i] = other_sign ? remainder + b[i] : remainder;
  }
  return result;
}

// Returns a b + c, rounded once where the processor has an instruction for that. It is not left to
// the compiler, which would choose one of several products.
inline Lane MultiplyAdd(const Lane& a, const Lane& b, const Lane& c) {
#ifdef __FMA__
  Lane result;
  for (int i = 0; i < kLanes; ++i) result[i] = std::fma(a[i], b[i], c[i]);
  return result;
#else
  return a * b + c;
#endif
}

POLYEST_UNARY(kNegate, -a)
POLYEST_UNARY(kNot, Truth(a, Lane::Zero(), std::equal_to<>()))
POLYEST_UNARY(kAbsolute, a.abs())
POLYEST_UNARY(kSign, Sign(a))
POLYEST_UNARY(kSquareRoot, Sqrt(a))
POLYEST_UNARY(kExponential, a.exp())
POLYEST_UNARY(kLogarithm, Log(a))
POLYEST_UNARY(kLogarithm10, Log10(a))
POLYEST_UNARY(kSine, Sin(a))
POLYEST_UNARY(kCosine, Cos(a))
POLYEST_UNARY(kTangent, Tan(a))
POLYEST_UNARY(kArcSine, Asin(a))
POLYEST_UNARY(kArcCosine, Acos(a))
POLYEST_UNARY(kArcTangent, Atan(a))
POLYEST_UNARY(kHyperbolicSine, Sinh(a))
POLYEST_UNARY(kHyperbolicCosine, Cosh(a))
POLYEST_UNARY(kHyperbolicTangent, HyperbolicTangent(a))
POLYEST_UNARY(kFloor, a.floor())
POLYEST_UNARY(kCeiling, a.ceil())

POLYEST_BINARY(kAdd, a + b)
POLYEST_BINARY(kSubtract, a - b)
POLYEST_BINARY(kMultiply, a* b)
POLYEST_BINARY(kDivide, a / b)
POLYEST_BINARY(kPower, Pow(a, b))
POLYEST_BINARY(kMinimum, Minimum(a, b))
POLYEST_BINARY(kMaximum, Maximum(a, b))
POLYEST_BINARY(kArcTangent2, Atan2(a, b))
POLYEST_BINARY(kHypotenuse, Hypot(a, b))
POLYEST_BINARY(kModulo, Modulo(a, b))
POLYEST_BINARY(kLess, Truth(a, b, std::less<>()))
POLYEST_BINARY(kLessOrEqual, Truth(a, b, std::less_equal<>()))
POLYEST_BINARY(kEqual, Truth(a, b, std::equal_to<>()))
POLYEST_BINARY(kNotEqual, Truth(a, b, std::not_equal_to<>()))
POLYEST_BINARY(kAnd, Truth(a, b, [](double p, double q) { return p != 0 && q != 0; }))
POLYEST_BINARY(kOr, Truth(a, b, [](double p, double q) { return p != 0 || q != 0; }))

POLYEST_TERNARY(kSelect, Select(a, b, c))
POLYEST_TERNARY(kMultiplyAdd, MultiplyAdd(a, b, c))
POLYEST_TERNARY(kMultiplySubtract, MultiplyAdd(a, b, -c))
POLYEST_TERNARY(kSubtractMultiplied, MultiplyAdd(-a, b, c))

#undef POLYEST_UNARY
#undef POLYEST_BINARY
#undef POLYEST_TERNARY

}  // namespace polyest::internal::equations
