#pragma once

// Expressions compiled into a sequence of instructions without branches. Each instruction processes
// up to kRows rows at once, which makes the cost of its dispatch small.
//
// Subexpressions that several expressions share are computed once, and those of the time alone once
// for all rows. Those of the parameters alone are computed again only where the parameters are not
// those of the program's last run in this thread; a quotient whose divisor is one of them becomes a
// product with its reciprocal. An intermediate value occupies a register of kRows rows for as long
// as it is needed. A product that is only added or subtracted once is fused with that sum into one
// operation. An instruction computes two operations where nothing but the second reads the result
// of the first, because loading and storing take longer than computing. The first run in a thread
// may allocate memory; later runs do not.

#include <cstdint>
#include <span>
#include <vector>

#include "core/common/types.h"
#include "core/model/equations/graph.h"
#include "core/model/equations/kernels.h"
#include "core/model/lane.h"

namespace polyest::internal::equations {

// The place where the values of a variable are stored: a column of one of the blocks, or the time,
// which is one value for all rows.
struct VariablePlace {
  static constexpr int kTime = -1;
  int block = 0;  // index of the block, or kTime
  Eigen::Index column = 0;
};

class Program {
 public:
  static constexpr Eigen::Index kRows = 64;
  static constexpr int kNone = -2;  // no block

  Program() = default;
  Program(Program&&) = default;
  Program& operator=(Program&&) = default;
  // Compiles a program that writes the value of roots[i] into column i of the results. places[i]
  // says where variable i is stored; `parameters` is the index of the block that changes seldom
  // from run to run, or kNone. The tables must outlive the program.
  Program(const Graph& graph, const std::vector<NodeId>& roots,
          const std::vector<VariablePlace>& places, const std::vector<Lookup>& tables,
          int parameters = kNone);

  // Evaluates the program. Every block must have as many rows as `results`, a multiple of kLanes; a
  // block that the program does not read may have any size. No block may overlap the results.
  void Run(double time_s, std::span<const ConstBlock* const> blocks, Block results) const;

  Eigen::Index results() const { return first_register_ - first_result_; }
  // Instructions for each chunk of rows, those for all rows together, and those for each chunk of
  // rows with other parameters.
  int instructions() const { return static_cast<int>(instructions_.size()); }
  int instructions_of_time() const { return static_cast<int>(of_time_.size()); }
  int instructions_of_parameters() const { return static_cast<int>(of_parameters_.size()); }
  int registers() const { return registers_; }

 private:
  friend class ProgramBuilder;

  struct Load {
    std::uint32_t slot;
    VariablePlace place;
  };

  struct Prepared;
  struct OfThread;

  // Returns what this thread keeps for these rows, with the slots of all but loads and results.
  Prepared& Prepare(Eigen::Index row, Eigen::Index rows) const;
  void SetUp(OfThread& of_thread, Eigen::Index row, Eigen::Index rows, Prepared& place) const;
  // Computes what is kept of the parameters, unless they are those of the last run.
  void UseParameters(const ConstBlock& parameters, Prepared& place) const;

  std::vector<Instruction> of_time_;  // each has a slot of one value of its own
  std::vector<Instruction> of_parameters_;
  std::vector<Instruction> instructions_;
  std::vector<Load> loads_;
  std::vector<Lane> constants_;
  std::vector<Eigen::Index> zero_;  // columns of the results that are always 0
  std::int64_t id_ = 0;             // which no other program has
  int parameters_ = kNone;
  std::vector<Eigen::Index> parameter_columns_;  // those that of_parameters_ reads
  // Order of the slots: the time, the constants, the results of of_time_, what is kept of those of
  // of_parameters_, the loads, the columns of the results, the registers.
  std::uint32_t first_kept_ = 1;
  std::uint32_t kept_ = 0;
  std::uint32_t first_result_ = 1;
  std::uint32_t first_register_ = 1;
  int registers_ = 0;
};

}  // namespace polyest::internal::equations
