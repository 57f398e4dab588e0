#pragma once

// What an expression is made of once it has been read.

#include <cstdint>

namespace polyest::internal::equations {

enum class Operation : std::uint8_t {
  // Leaves
  kConstant,
  kVariable,
  // One operand
  kNegate,
  kNot,
  kAbsolute,
  kSign,
  kSquareRoot,
  kExponential,
  kLogarithm,
  kLogarithm10,
  kSine,
  kCosine,
  kTangent,
  kArcSine,
  kArcCosine,
  kArcTangent,
  kHyperbolicSine,
  kHyperbolicCosine,
  kHyperbolicTangent,
  kFloor,
  kCeiling,
  // Two operands
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kPower,
  kMinimum,
  kMaximum,
  kArcTangent2,
  kHypotenuse,
  kModulo,
  kLess,
  kLessOrEqual,
  kEqual,
  kNotEqual,
  kAnd,
  kOr,
  // Three operands
  kSelect,              // a ≠ 0 ? b : c
  kMultiplyAdd,         // a b + c
  kMultiplySubtract,    // a b − c
  kSubtractMultiplied,  // c − a b
  // One or two operands and a table
  kLookup,
  kLookupSlopeX,  // ∂/∂x
  kLookupSlopeY,  // ∂/∂y
};

// The number of operands; −1 for a lookup, whose table says how many.
constexpr int Operands(Operation operation) {
  if (operation <= Operation::kVariable) return 0;
  if (operation <= Operation::kCeiling) return 1;
  if (operation <= Operation::kOr) return 2;
  if (operation <= Operation::kSubtractMultiplied) return 3;
  return -1;
}

constexpr bool IsLookup(Operation operation) { return operation >= Operation::kLookup; }

// a ∘ b = b ∘ a, to the bit.
constexpr bool IsCommutative(Operation operation) {
  switch (operation) {
    case Operation::kAdd:
    case Operation::kMultiply:
    case Operation::kMinimum:
    case Operation::kMaximum:
    case Operation::kHypotenuse:
    case Operation::kEqual:
    case Operation::kNotEqual:
    case Operation::kAnd:
    case Operation::kOr:
      return true;
    default:
      return false;
  }
}

}  // namespace polyest::internal::equations
