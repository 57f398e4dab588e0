#include "core/model/equations/kernels.h"

#include <array>
#include <utility>

#include "core/common/check.h"
#include "core/model/equations/lane_functions.h"

namespace polyest::internal::equations {
namespace {

// Reads an operand, kLanes rows starting at `row`.
class Operand {
 public:
  Operand(const Instruction& instruction, int number, const double* const* slots)
      : values_(slots[instruction.operands[number]]), mask_(instruction.masks[number]) {}

  Lane At(Eigen::Index row) const { return Eigen::Map<const Lane>(values_ + (row & mask_)); }
  double ValueAt(Eigen::Index row) const { return values_[row & mask_]; }

 private:
  const double* values_;
  Eigen::Index mask_;
};

// Stores the values of `function` for all rows, kLanes rows at a time.
template <class Function>
void ForRows(double* result, Eigen::Index rows, const Function& function) {
  for (Eigen::Index row = 0; row < rows; row += kLanes) {
    Eigen::Map<Lane>(result + row) = function(row);
  }
}

// Applies an operation to as many of the operands as it has.
template <Operation operation>
[[gnu::always_inline]] inline Lane ApplyAt(Eigen::Index row, const Operand& a, const Operand& b,
                                           const Operand& c) {
  using Function = LaneFunction<operation>;
  if constexpr (Operands(operation) == 1) {
    return Function::Apply(a.At(row));
  } else if constexpr (Operands(operation) == 2) {
    return Function::Apply(a.At(row), b.At(row));
  } else {
    return Function::Apply(a.At(row), b.At(row), c.At(row));
  }
}

template <Operation operation>
void Single(const Instruction& instruction, double* const* slots, Eigen::Index rows) {
  const Operand a(instruction, 0, slots), b(instruction, 1, slots), c(instruction, 2, slots);
  ForRows(slots[instruction.result], rows,
          [&](Eigen::Index row) { return ApplyAt<operation>(row, a, b, c); });
}

// Applies an operation; `inner` is its operand at the position, x and y are the others in order.
template <Operation operation, int kPosition>
[[gnu::always_inline]] inline Lane ApplyWith(const Lane& inner, const Lane& x, const Lane& y) {
  using Function = LaneFunction<operation>;
  if constexpr (Operands(operation) == 2) {
    return kPosition == 0 ? Function::Apply(inner, x) : Function::Apply(x, inner);
  } else {
    return kPosition == 0 ? Function::Apply(inner, x, y) : Function::Apply(x, y, inner);
  }
}

template <Operation kInner, Operation operation, int kPosition>
void Pair(const Instruction& instruction, double* const* slots, Eigen::Index rows) {
  constexpr int kOfInner = Operands(kInner);
  const Operand a(instruction, 0, slots), b(instruction, 1, slots), c(instruction, 2, slots),
      x(instruction, kOfInner, slots), y(instruction, kOfInner + 1, slots);
  ForRows(slots[instruction.result], rows, [&](Eigen::Index row) {
    return ApplyWith<operation, kPosition>(ApplyAt<kInner>(row, a, b, c), x.At(row), y.At(row));
  });
}

void Copy(const Instruction& instruction, double* const* slots, Eigen::Index rows) {
  const Operand a(instruction, 0, slots);
  ForRows(slots[instruction.result], rows, [&](Eigen::Index row) { return a.At(row); });
}

template <double (Lookup::*kFunction)(double, double) const>
void Look(const Instruction& instruction, double* const* slots, Eigen::Index rows) {
  const Operand x(instruction, 0, slots), y(instruction, 1, slots);
  double* result = slots[instruction.result];
  for (Eigen::Index row = 0; row < rows; ++row) {
    // The result may overwrite an operand with one value per row, but never one with a single value
    // for all rows.
    result[row] = (instruction.lookup->*kFunction)(x.ValueAt(row), y.ValueAt(row));
  }
}

// The operations that have a LaneFunction, and their kernels.
constexpr auto kFirstSingle = static_cast<size_t>(Operation::kNegate);
constexpr auto kLastSingle = static_cast<size_t>(Operation::kSubtractMultiplied);

template <size_t... kOffsets>
constexpr auto MakeSingleKernels(std::index_sequence<kOffsets...>) {
  return std::array<Kernel, sizeof...(kOffsets)>{
      Single<static_cast<Operation>(kFirstSingle + kOffsets)>...};
}
constexpr auto kSingleKernels =
    MakeSingleKernels(std::make_index_sequence<kLastSingle - kFirstSingle + 1>());

// Returns the kernel for the position if it is one of those given.
template <Operation kInner, Operation operation, int... kPositions>
Kernel PairAt(int position) {
  Kernel kernel = nullptr;
  ((kernel = position == kPositions ? Pair<kInner, operation, kPositions> : kernel), ...);
  return kernel;
}

template <Operation kInner>
Kernel SelectPairOf(Operation operation, int position) {
  using enum Operation;
  if (operation == kMultiply) return PairAt<kInner, kMultiply, 0>(position);
  // A product and a sum are one operation already.
  if constexpr (kInner != kMultiply) {
    if (operation == kAdd) return PairAt<kInner, kAdd, 0>(position);
    if (operation == kSubtract) return PairAt<kInner, kSubtract, 0, 1>(position);
  }
  if (operation == kMultiplyAdd) return PairAt<kInner, kMultiplyAdd, 0, 2>(position);
  if (operation == kMultiplySubtract) return PairAt<kInner, kMultiplySubtract, 0, 2>(position);
  if (operation == kSubtractMultiplied) return PairAt<kInner, kSubtractMultiplied, 0, 2>(position);
  return nullptr;
}

}  // namespace

Kernel SelectKernel(Operation operation) {
  switch (operation) {
    case Operation::kConstant:
    case Operation::kVariable:
      POLYEST_CHECK(!"an operation that is carried out");
      return nullptr;
    case Operation::kLookup:
      return Look<&Lookup::Value>;
    case Operation::kLookupSlopeX:
      return Look<&Lookup::SlopeX>;
    case Operation::kLookupSlopeY:
      return Look<&Lookup::SlopeY>;
    default:
      return kSingleKernels[static_cast<size_t>(operation) - kFirstSingle];
  }
}

Kernel SelectPair(Operation inner, Operation operation, int position) {
  switch (inner) {
    case Operation::kAdd:
      return SelectPairOf<Operation::kAdd>(operation, position);
    case Operation::kSubtract:
      return SelectPairOf<Operation::kSubtract>(operation, position);
    case Operation::kMultiply:
      return SelectPairOf<Operation::kMultiply>(operation, position);
    case Operation::kMultiplyAdd:
      return SelectPairOf<Operation::kMultiplyAdd>(operation, position);
    case Operation::kMultiplySubtract:
      return SelectPairOf<Operation::kMultiplySubtract>(operation, position);
    case Operation::kSubtractMultiplied:
      return SelectPairOf<Operation::kSubtractMultiplied>(operation, position);
    default:
      return nullptr;
  }
}

Kernel CopyKernel() { return Copy; }

double EvaluateAtPoint(Operation operation, double a, double b, double c) {
  POLYEST_CHECK(!IsLookup(operation));
  Lane values[3] = {Lane::Constant(a), Lane::Constant(b), Lane::Constant(c)};
  Lane result;
  double* const slots[] = {values[0].data(), values[1].data(), values[2].data(), result.data()};
  const Instruction instruction{.kernel = SelectKernel(operation),
                                .result = 3,
                                .operands = {0, 1, 2},
                                .masks = {},
                                .lookup = nullptr};
  instruction.kernel(instruction, slots, kLanes);
  return result[0];
}

}  // namespace polyest::internal::equations
