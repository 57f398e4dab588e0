#pragma once

// The instructions of the register machine: each applies one operation to every row of a chunk of a
// block.

#include <cstdint>

#include "core/model/equations/lookup.h"
#include "core/model/equations/operation.h"

namespace polyest::internal::equations {

struct Instruction;

// Carries out the instruction on `rows` rows, a multiple of kLanes. slots[i] points to the values
// of slot i: one for each row or, where they are the same for all rows, kLanes of them.
using Kernel = void (*)(const Instruction& instruction, double* const* slots, Eigen::Index rows);

struct Instruction {
  static constexpr int kMaxOperands = 5;

  Kernel kernel;
  std::uint32_t result;
  std::uint32_t operands[kMaxOperands];  // slots; one of them may be the result's
  // Masks of the operands' slots: ~0, or 0 where the values are the same for all rows. The values
  // of a row begin at (row & mask).
  std::int32_t masks[kMaxOperands];
  const Lookup* lookup;  // the table, for a lookup
};

// Returns the kernel for the operation.
Kernel SelectKernel(Operation operation);

// Returns the kernel for an operation one of whose operands, that at `position`, is the result of
// another, `inner`; the instruction's operands are those of `inner` and then the others. Its values
// are those of the two operations one after the other, bit for bit. Returns nullptr if there is
// none: they exist for sums, differences and products, at the first of two positions that are
// equivalent.
Kernel SelectPair(Operation inner, Operation operation, int position);

// Returns the kernel that copies its operand.
Kernel CopyKernel();

// Returns the operation's value at one point, bit for bit the value that the kernels give.
double EvaluateAtPoint(Operation operation, double a, double b, double c);

}  // namespace polyest::internal::equations
