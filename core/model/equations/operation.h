#pragma once

// The operations that an expression consists of once it is parsed.

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

// Returns the number of operands, or −1 for a lookup, whose table determines it.
constexpr int Operands(Operation operation) {
  if (operation <= Operation::kVariable) return 0;
  if (operation <= Operation::kCeiling) return 1;
  if (operation <= Operation::kOr) return 2;
  if (operation <= Operation::kSubtractMultiplied) return 3;
  return -1;
}

constexpr bool IsLookup(Operation operation) { return operation >= Operation::kLookup; }

// Whether a ∘ b = b ∘ a holds bit for bit.
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
