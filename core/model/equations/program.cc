#include "core/model/equations/program.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "core/common/check.h"

namespace polyest::internal::equations {
namespace {

// Memory that all programs of a thread share.
struct Scratch {
  Eigen::ArrayXd registers;
  std::vector<double*> slots;
};

Scratch& ThreadScratch(size_t slots, Eigen::Index registers) {
  thread_local Scratch scratch;
  if (scratch.slots.size() < slots) scratch.slots.resize(slots);
  if (scratch.registers.size() < registers) scratch.registers.resize(registers);
  return scratch;
}

// What a program has computed of some parameters.
struct OfParameters {
  std::int64_t program = 0;
  Eigen::Index row = 0, rows = 0;
  Eigen::ArrayXd parameters;  // the columns that it reads, of kRows rows each
  Eigen::ArrayXd values;      // of kRows rows each
};

// Returns the place of this thread for such values, where those of another program may be. There is
// room for two chunks of each of eight programs; those of a model have successive numbers.
OfParameters& ThreadOfParameters(std::int64_t program, Eigen::Index row) {
  thread_local std::array<OfParameters, 16> places;
  return places[static_cast<size_t>(2 * program + row / Program::kRows) % places.size()];
}

}  // namespace

void Program::UseParameters(const ConstBlock& parameters, Eigen::Index row, Eigen::Index rows,
                            double** slots) const {
  OfParameters& known = ThreadOfParameters(id_, row);
  bool same = known.program == id_ && known.row == row && known.rows == rows;
  if (known.values.size() < kept_ * kRows) known.values.resize(kept_ * kRows);
  if (const auto size = std::ssize(parameter_columns_) * kRows; known.parameters.size() < size) {
    known.parameters.resize(size);
  }
  const size_t bytes = static_cast<size_t>(rows) * sizeof(double);
  double* copy = known.parameters.data();
  for (const Eigen::Index column : parameter_columns_) {
    const double* const given = parameters.data() + column * parameters.outerStride() + row;
    if (!same || std::memcmp(copy, given, bytes) != 0) {
      std::memcpy(copy, given, bytes);
      same = false;
    }
    copy += kRows;
  }
  for (std::uint32_t i = 0; i < kept_; ++i) {
    slots[first_kept_ + i] = known.values.data() + i * kRows;
  }
  if (same) return;
  known.program = id_;
  known.row = row;
  known.rows = rows;
  for (const Instruction& instruction : of_parameters_) {
    instruction.kernel(instruction, slots, rows);
  }
}

void Program::Run(double time_s, std::span<const ConstBlock* const> blocks, Block results) const {
  const Eigen::Index rows = results.rows();
  POLYEST_CHECK(rows % kLanes == 0);
  // A kernel writes kLanes values at least.
  const Eigen::Index values_of_time = std::ssize(of_time_) * kLanes;
  Scratch& scratch = ThreadScratch(first_register_ + static_cast<size_t>(registers_),
                                   values_of_time + registers_ * kRows);
  double** const slots = scratch.slots.data();
  Lane time = Lane::Constant(time_s);
  slots[0] = time.data();
  double** next = slots + 1;
  // Kernels only read the slots of operands, so the cast is safe: see Kernel.
  for (const Lane& constant : constants_) *next++ = const_cast<double*>(constant.data());
  double* const registers = scratch.registers.data();
  for (size_t i = 0; i < of_time_.size(); ++i) {
    slots[of_time_[i].result] = registers + static_cast<Eigen::Index>(i) * kLanes;
  }
  for (int i = 0; i < registers_; ++i) {
    slots[first_register_ + static_cast<size_t>(i)] = registers + values_of_time + i * kRows;
  }
  for (const Instruction& instruction : of_time_) instruction.kernel(instruction, slots, kLanes);
  for (const Eigen::Index column : zero_) results.col(column).setZero();
  for (Eigen::Index row = 0; row < rows; row += kRows) {
    for (const Load& load : loads_) {
      const ConstBlock& block = *blocks[static_cast<size_t>(load.place.block)];
      slots[load.slot] =
          const_cast<double*>(block.data()) + load.place.column * block.outerStride() + row;
    }
    for (Eigen::Index column = 0; column < results.cols(); ++column) {
      slots[first_result_ + column] = results.data() + column * results.outerStride() + row;
    }
    const Eigen::Index chunk = std::min(kRows, rows - row);
    if (!of_parameters_.empty()) {
      UseParameters(*blocks[static_cast<size_t>(parameters_)], row, chunk, slots);
    }
    for (const Instruction& instruction : instructions_) {
      instruction.kernel(instruction, slots, chunk);
    }
  }
}

}  // namespace polyest::internal::equations
