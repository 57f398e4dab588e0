#pragma once

// The instructions of the register machine: each applies one operation to every row of a chunk of a
// block.

#include <cstdint>

#include "core/model/equations/lookup.h"
#include "core/model/equations/operation.h"

namespace polyest::internal::equations {

struct Instruction;

// Carries out the instruction on `rows` rows, a multiple of kLanes. slots[i] points to the values
// of slot i.
using Kernel = void (*)(const Instruction& instruction, double* const* slots, Eigen::Index rows);

struct Instruction {
  Kernel kernel;
  std::uint32_t result;
  std::uint32_t operands[3];  // slots; one of them may be the result's
  const Lookup* lookup;       // the table, for a lookup
};

// Returns the kernel for the operation. `uniform_x` says whether the slot of operand x holds a
// single value for all rows.
Kernel SelectKernel(Operation operation, bool uniform_a, bool uniform_b, bool uniform_c);

// Returns the kernel that copies its operand.
Kernel CopyKernel(bool uniform);

// Returns the operation's value at one point, bit for bit the value that the kernels give.
double EvaluateAtPoint(Operation operation, double a, double b, double c);

}  // namespace polyest::internal::equations
