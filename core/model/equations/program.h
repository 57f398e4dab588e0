#pragma once

// Expressions as a straight sequence of instructions, each carried out on up to kRows rows at once,
// so that finding out what to do costs little beside doing it.
//
// What several expressions share is computed once. An intermediate value lives in a register of
// kRows rows for as long as it is needed; a product that is only added to something is one
// instruction with the sum. The first run in a thread may allocate; the ones after it do not.

#include <span>
#include <vector>

#include "core/common/types.h"
#include "core/model/equations/graph.h"
#include "core/model/equations/kernels.h"

namespace polyest::internal::equations {

// Where the values of a variable are: a column of one of the blocks, or the time, the same for all.
struct VariablePlace {
  static constexpr int kTime = -1;
  int block = 0;  // or kTime
  Eigen::Index column = 0;
};

class Program {
 public:
  static constexpr Eigen::Index kRows = 64;

  Program() = default;
  // Computes roots[i] into column i of the results. places[i] is where variable i is. The tables
  // must outlive the program.
  Program(const Graph& graph, const std::vector<NodeId>& roots,
          const std::vector<VariablePlace>& places, const std::vector<Lookup>& tables);

  // Every block has as many rows as the results, a multiple of kLanes; blocks that the program
  // takes nothing from may be of any size. No block may overlap the results.
  void Run(double time_s, std::span<const ConstBlock* const> blocks, Block results) const;

  Eigen::Index results() const { return first_register_ - first_result_; }
  int instructions() const { return static_cast<int>(instructions_.size()); }
  int registers() const { return registers_; }

 private:
  friend class ProgramBuilder;

  struct Load {
    std::uint32_t slot;
    VariablePlace place;
  };

  std::vector<Instruction> instructions_;
  std::vector<Load> loads_;
  std::vector<double> constants_;
  std::vector<Eigen::Index> zero_;  // columns that are 0 for ever
  // Slots: the time, the constants, the loads, the columns of the results, the registers.
  std::uint32_t first_result_ = 0;
  std::uint32_t first_register_ = 0;
  int registers_ = 0;
};

}  // namespace polyest::internal::equations
