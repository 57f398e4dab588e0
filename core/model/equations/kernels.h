#pragma once

// The instructions of the register machine: one operation on every row of a chunk of a block.

#include <cstdint>

#include "core/model/equations/lookup.h"
#include "core/model/equations/operation.h"

namespace polyest::internal::equations {

struct Instruction;

// Carries out the instruction on `rows` rows, a multiple of kLanes. slots[i] is where the values of
// the i-th slot begin.
using Kernel = void (*)(const Instruction& instruction, double* const* slots, Eigen::Index rows);

struct Instruction {
  Kernel kernel;
  std::uint32_t result;
  std::uint32_t operands[3];  // slots; the result's may be among them
  const Lookup* lookup;       // of a lookup
};

// `uniform`, of each operand: its slot has one value, for all rows.
Kernel SelectKernel(Operation operation, bool uniform_a, bool uniform_b, bool uniform_c);

// The kernel that copies its operand.
Kernel CopyKernel(bool uniform);

// The operation at one point, to the bit what the kernels give.
double EvaluateAtPoint(Operation operation, double a, double b, double c);

}  // namespace polyest::internal::equations
