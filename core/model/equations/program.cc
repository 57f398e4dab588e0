#include "core/model/equations/program.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "core/common/check.h"

namespace polyest::internal::equations {
namespace {

constexpr size_t kPlaces = 16;  // a power of 2

}  // namespace

// What a thread keeps of a program's last run, for a chunk of rows.
struct Program::Prepared {
  std::int64_t program = 0;
  Eigen::Index row = 0, rows = 0;
  Lane time;
  std::vector<double*> slots;  // all but those of loads and results do not change
  bool has_kept = false;       // whether `kept` holds the values for `parameters`
  Eigen::ArrayXd parameters;   // the columns that of_parameters_ reads, of kRows rows each
  Eigen::ArrayXd kept;         // of kRows rows each
};

struct Program::OfThread {
  Eigen::ArrayXd registers;  // all programs share them
  // There is room for two chunks of each of eight programs; those of a model have successive
  // numbers.
  std::array<Prepared, kPlaces> places;
};

Program::Prepared& Program::Prepare(Eigen::Index row, Eigen::Index rows) const {
  thread_local OfThread of_thread;
  const auto number = static_cast<size_t>(2 * id_ + row / kRows);
  Prepared& place = of_thread.places[number % kPlaces];
  if (place.program != id_ || place.row != row || place.rows != rows) {
    SetUp(of_thread, row, rows, place);
  }
  return place;
}

void Program::SetUp(OfThread& of_thread, Eigen::Index row, Eigen::Index rows,
                    Prepared& place) const {
  const Eigen::Index of_time = std::ssize(of_time_) * kLanes;  // a kernel writes so many values
  const Eigen::Index size = of_time + registers_ * kRows;
  if (of_thread.registers.size() < size) {
    of_thread.registers.resize(size);
    for (Prepared& other : of_thread.places) other.program = 0;  // its slots point to the old ones
  }
  place.program = id_;
  place.row = row;
  place.rows = rows;
  place.has_kept = false;
  place.parameters.resize(std::ssize(parameter_columns_) * kRows);
  place.kept.resize(kept_ * kRows);
  place.slots.resize(first_register_ + static_cast<size_t>(registers_));
  double** const slots = place.slots.data();
  double* const registers = of_thread.registers.data();
  slots[0] = place.time.data();
  // Kernels only read the slots of operands, so the cast is safe: see Kernel.
  for (size_t i = 0; i < constants_.size(); ++i) {
    slots[1 + i] = const_cast<double*>(constants_[i].data());
  }
  for (size_t i = 0; i < of_time_.size(); ++i) {
    slots[of_time_[i].result] = registers + static_cast<Eigen::Index>(i) * kLanes;
  }
  for (std::uint32_t i = 0; i < kept_; ++i) slots[first_kept_ + i] = place.kept.data() + i * kRows;
  for (int i = 0; i < registers_; ++i) {
    slots[first_register_ + static_cast<size_t>(i)] = registers + of_time + i * kRows;
  }
}

void Program::UseParameters(const ConstBlock& parameters, Prepared& place) const {
  bool same = place.has_kept;
  const size_t bytes = static_cast<size_t>(place.rows) * sizeof(double);
  double* copy = place.parameters.data();
  for (const Eigen::Index column : parameter_columns_) {
    const double* const given = parameters.data() + column * parameters.outerStride() + place.row;
    if (!same || std::memcmp(copy, given, bytes) != 0) {
      std::memcpy(copy, given, bytes);
      same = false;
    }
    copy += kRows;
  }
  if (same) return;
  place.has_kept = true;
  for (const Instruction& instruction : of_parameters_) {
    instruction.kernel(instruction, place.slots.data(), place.rows);
  }
}

void Program::Run(double time_s, std::span<const ConstBlock* const> blocks, Block results) const {
  const Eigen::Index rows = results.rows();
  POLYEST_CHECK(rows % kLanes == 0);
  for (const Eigen::Index column : zero_) results.col(column).setZero();
  for (Eigen::Index row = 0; row < rows; row += kRows) {
    const Eigen::Index chunk = std::min(kRows, rows - row);
    Prepared& place = Prepare(row, chunk);
    double** const slots = place.slots.data();
    place.time.setConstant(time_s);
    for (const Load& load : loads_) {
      const ConstBlock& block = *blocks[static_cast<size_t>(load.place.block)];
      slots[load.slot] =
          const_cast<double*>(block.data()) + load.place.column * block.outerStride() + row;
    }
    for (Eigen::Index column = 0; column < results.cols(); ++column) {
      slots[first_result_ + column] = results.data() + column * results.outerStride() + row;
    }
    for (const Instruction& instruction : of_time_) instruction.kernel(instruction, slots, kLanes);
    if (!of_parameters_.empty()) UseParameters(*blocks[static_cast<size_t>(parameters_)], place);
    for (const Instruction& instruction : instructions_) {
      instruction.kernel(instruction, slots, chunk);
    }
  }
}

}  // namespace polyest::internal::equations
