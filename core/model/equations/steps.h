#pragma once

// The nodes of a graph as a program computes them: divisions by what depends on parameters alone
// are products, a product and a sum are one operation, and two operations are one step where only
// the second reads the first.

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "core/model/equations/graph.h"
#include "core/model/equations/kernels.h"
#include "core/model/equations/program.h"

namespace polyest::internal::equations {

inline constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

// The operation of which one operand is computed by the same instruction.
struct Inner {
  Operation operation;
  int position;  // of its result among the operands of the other operation
};

// One instruction: an operation, or two.
struct Step {
  Operation operation = Operation::kConstant;
  // Those of `inner` come first, then the others in order; −1 after the last.
  std::array<NodeId, Instruction::kMaxOperands> operands{};
  std::optional<Inner> inner = std::nullopt;
  int uses = 0;       // number of steps and roots that read it
  int last_use = -1;  // position of the last instruction that reads it
  bool needed = false;
  bool of_time = false;        // whether all that it depends on is the time
  bool of_parameters = false;  // whether it depends on parameters, and on nothing else
  bool kept = false;           // of parameters, and read by what is not, or a root
  std::uint32_t slot = kNowhere;
};

// Returns a step for each node of the graph, in its order, and after them reciprocals. `roots` are
// the nodes whose values are asked for, places[i] is that of variable i, and `parameters` the block
// that changes seldom.
std::vector<Step> MakeSteps(const Graph& graph, const std::vector<NodeId>& roots,
                            const std::vector<VariablePlace>& places, int parameters);

}  // namespace polyest::internal::equations
