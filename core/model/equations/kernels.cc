#include "core/model/equations/kernels.h"

#include "core/common/check.h"
#include "core/model/equations/lane_functions.h"

namespace polyest::internal::equations {
namespace {

// Reads an operand: kLanes rows starting at `row`, or one value for all rows.
template <bool uniform>
class Operand {
 public:
  explicit Operand(const double* values) : values_(values) {}
  Lane At(Eigen::Index row) const { return Eigen::Map<const Lane>(values_ + row); }

 private:
  const double* values_;
};

template <>
class Operand<true> {
 public:
  explicit Operand(const double* values) : value_(Lane::Constant(*values)) {}
  const Lane& At(Eigen::Index) const { return value_; }

 private:
  const Lane value_;
};

// Stores the values of `function` for all rows, kLanes rows at a time.
template <class Function>
void ForRows(double* result, Eigen::Index rows, const Function& function) {
  for (Eigen::Index row = 0; row < rows; row += kLanes) {
    Eigen::Map<Lane>(result + row) = function(row);
  }
}

template <Operation operation, bool kUniformA>
void Unary(const Instruction& instruction, double* const* slots, Eigen::Index rows) {
  const Operand<kUniformA> a(slots[instruction.operands[0]]);
  ForRows(slots[instruction.result], rows,
          [&](Eigen::Index row) { return LaneFunction<operation>::Apply(a.At(row)); });
}

template <Operation operation, bool kUniformA, bool kUniformB>
void Binary(const Instruction& instruction, double* const* slots, Eigen::Index rows) {
  const Operand<kUniformA> a(slots[instruction.operands[0]]);
  const Operand<kUniformB> b(slots[instruction.operands[1]]);
  ForRows(slots[instruction.result], rows,
          [&](Eigen::Index row) { return LaneFunction<operation>::Apply(a.At(row), b.At(row)); });
}

template <Operation operation, bool kUniformA, bool kUniformB, bool kUniformC>
void Ternary(const Instruction& instruction, double* const* slots, Eigen::Index rows) {
  const Operand<kUniformA> a(slots[instruction.operands[0]]);
  const Operand<kUniformB> b(slots[instruction.operands[1]]);
  const Operand<kUniformC> c(slots[instruction.operands[2]]);
  ForRows(slots[instruction.result], rows, [&](Eigen::Index row) {
    return LaneFunction<operation>::Apply(a.At(row), b.At(row), c.At(row));
  });
}

template <bool kUniform>
void Copy(const Instruction& instruction, double* const* slots, Eigen::Index rows) {
  const Operand<kUniform> a(slots[instruction.operands[0]]);
  ForRows(slots[instruction.result], rows, [&](Eigen::Index row) -> Lane { return a.At(row); });
}

template <double (Lookup::*kFunction)(double, double) const, bool kUniformA, bool kUniformB>
void Look(const Instruction& instruction, double* const* slots, Eigen::Index rows) {
  const double* x = slots[instruction.operands[0]];
  const double* y = slots[instruction.operands[1]];
  double* result = slots[instruction.result];
  for (Eigen::Index row = 0; row < rows; ++row) {
    // The result may overwrite an operand with one value per row, but never one with a single value
    // for all rows.
    result[row] = (instruction.lookup->*kFunction)(x[kUniformA ? 0 : row], y[kUniformB ? 0 : row]);
  }
}

template <double (Lookup::*kFunction)(double, double) const>
Kernel SelectLook(bool uniform_a, bool uniform_b) {
  if (uniform_a) return uniform_b ? Look<kFunction, true, true> : Look<kFunction, true, false>;
  return uniform_b ? Look<kFunction, false, true> : Look<kFunction, false, false>;
}

template <Operation operation>
Kernel SelectUnary(bool uniform_a) {
  return uniform_a ? Unary<operation, true> : Unary<operation, false>;
}

template <Operation operation>
Kernel SelectBinary(bool uniform_a, bool uniform_b) {
  if (uniform_a) {
    return uniform_b ? Binary<operation, true, true> : Binary<operation, true, false>;
  }
  return uniform_b ? Binary<operation, false, true> : Binary<operation, false, false>;
}

template <Operation operation, bool kUniformA>
Kernel SelectTernary(bool uniform_b, bool uniform_c) {
  if (uniform_b) {
    return uniform_c ? Ternary<operation, kUniformA, true, true>
                     : Ternary<operation, kUniformA, true, false>;
  }
  return uniform_c ? Ternary<operation, kUniformA, false, true>
                   : Ternary<operation, kUniformA, false, false>;
}

template <Operation operation>
Kernel SelectTernary(bool uniform_a, bool uniform_b, bool uniform_c) {
  return uniform_a ? SelectTernary<operation, true>(uniform_b, uniform_c)
                   : SelectTernary<operation, false>(uniform_b, uniform_c);
}

}  // namespace

Kernel SelectKernel(Operation operation, bool uniform_a, bool uniform_b, bool uniform_c) {
  switch (operation) {
#define POLYEST_UNARY(name) \
  case Operation::name:     \
    return SelectUnary<Operation::name>(uniform_a);
#define POLYEST_BINARY(name) \
  case Operation::name:      \
    return SelectBinary<Operation::name>(uniform_a, uniform_b);
#define POLYEST_TERNARY(name) \
  case Operation::name:       \
    return SelectTernary<Operation::name>(uniform_a, uniform_b, uniform_c);
    POLYEST_UNARY(kNegate)
    POLYEST_UNARY(kNot)
    POLYEST_UNARY(kAbsolute)
    POLYEST_UNARY(kSign)
    POLYEST_UNARY(kSquareRoot)
    POLYEST_UNARY(kExponential)
    POLYEST_UNARY(kLogarithm)
    POLYEST_UNARY(kLogarithm10)
    POLYEST_UNARY(kSine)
    POLYEST_UNARY(kCosine)
    POLYEST_UNARY(kTangent)
    POLYEST_UNARY(kArcSine)
    POLYEST_UNARY(kArcCosine)
    POLYEST_UNARY(kArcTangent)
    POLYEST_UNARY(kHyperbolicSine)
    POLYEST_UNARY(kHyperbolicCosine)
    POLYEST_UNARY(kHyperbolicTangent)
    POLYEST_UNARY(kFloor)
    POLYEST_UNARY(kCeiling)
    POLYEST_BINARY(kAdd)
    POLYEST_BINARY(kSubtract)
    POLYEST_BINARY(kMultiply)
    POLYEST_BINARY(kDivide)
    POLYEST_BINARY(kPower)
    POLYEST_BINARY(kMinimum)
    POLYEST_BINARY(kMaximum)
    POLYEST_BINARY(kArcTangent2)
    POLYEST_BINARY(kHypotenuse)
    POLYEST_BINARY(kModulo)
    POLYEST_BINARY(kLess)
    POLYEST_BINARY(kLessOrEqual)
    POLYEST_BINARY(kEqual)
    POLYEST_BINARY(kNotEqual)
    POLYEST_BINARY(kAnd)
    POLYEST_BINARY(kOr)
    POLYEST_TERNARY(kSelect)
    POLYEST_TERNARY(kMultiplyAdd)
    POLYEST_TERNARY(kMultiplySubtract)
    POLYEST_TERNARY(kSubtractMultiplied)
#undef POLYEST_UNARY
#undef POLYEST_BINARY
#undef POLYEST_TERNARY
    case Operation::kLookup:
      return SelectLook<&Lookup::Value>(uniform_a, uniform_b);
    case Operation::kLookupSlopeX:
      return SelectLook<&Lookup::SlopeX>(uniform_a, uniform_b);
    case Operation::kLookupSlopeY:
      return SelectLook<&Lookup::SlopeY>(uniform_a, uniform_b);
    case Operation::kConstant:
    case Operation::kVariable:
      break;
  }
  POLYEST_CHECK(!"an operation that is carried out");
  return nullptr;
}

Kernel CopyKernel(bool uniform) { return uniform ? Copy<true> : Copy<false>; }

double EvaluateAtPoint(Operation operation, double a, double b, double c) {
  POLYEST_CHECK(!IsLookup(operation));
  double values[3] = {a, b, c};
  alignas(64) double result[kLanes];
  double* const slots[] = {&values[0], &values[1], &values[2], result};
  const Kernel kernel = SelectKernel(operation, true, true, true);
  kernel({.kernel = kernel, .result = 3, .operands = {0, 1, 2}, .lookup = nullptr}, slots, kLanes);
  return result[0];
}

}  // namespace polyest::internal::equations
