#pragma once

// Finds the switches of expressions (core/model/switching_model.h) and freezes their modes.

#include <functional>
#include <map>
#include <vector>

#include "core/model/equations/graph.h"
#include "core/model/switching_model.h"

namespace polyest::internal::equations {

// Whether any of the expressions has an operation that switches, whatever its operands.
bool MaySwitch(const Graph& graph, const std::vector<NodeId>& roots);

// Whether any of the expressions depends on the variable.
bool DependOn(const Graph& graph, const std::vector<NodeId>& roots, NodeId variable);

// Rewrites expressions so that each operation that switches reads its mode from a variable:
//
//   sign a = σ,  abs a = σ a,  min(a, b) = σ < 0 ? a : b with σ of a − b,  a < b is σ < 0,
//   floor a = σ,  ceil a = σ + 1,  mod(a, b) = a − b σ with σ of a/b
//
// Arguments that differ by a constant factor share a switch. An operation whose argument depends on
// parameters only never switches and remains as it is, as do == and !=, which hold at isolated
// points only. `ceil a` is σ + 1 at an integer a as well.
class SwitchFreezer {
 public:
  // Reads the time from the variable `frozen_time` instead of `time`, and makes the variable of
  // each new switch by calling `make_mode`. The graph must outlive the object.
  SwitchFreezer(Graph& graph, NodeId time, NodeId frozen_time, std::vector<NodeId> parameters,
                std::function<NodeId()> make_mode);

  // Returns the rewritten expressions. Only the right-hand sides may `add` switches: in outputs, an
  // argument that is not yet known remains as it is.
  std::vector<NodeId> Freeze(const std::vector<NodeId>& roots, bool add);

  const std::vector<SwitchKind>& kinds() const { return kinds_; }
  const std::vector<NodeId>& arguments() const { return arguments_; }

 private:
  // A mode, or its negative: the sign of −a is −σ.
  struct Mode {
    NodeId variable = -1;
    bool negative = false;
  };

  NodeId Rewrite(const Node& node, NodeId old);
  NodeId Switch(Operation operation, NodeId a, NodeId b);
  bool SignOf(NodeId argument, Mode& mode);
  bool FloorOf(NodeId argument, Mode& mode);
  bool Find(SwitchKind kind, NodeId argument, Mode& mode);
  NodeId Sign(const Mode& mode);
  NodeId IsNegative(const Mode& mode);
  bool Varies(NodeId id);
  NodeId Make(Operation operation, NodeId a, NodeId b = -1, NodeId c = -1) {
    return graph_.Apply(operation, a, b, c);
  }

  Graph& graph_;
  std::function<NodeId()> make_mode_;
  bool add_ = false;
  std::vector<NodeId> parameters_;
  std::vector<bool> varies_;            // by node of the graph, as far as known
  std::map<NodeId, NodeId> rewritten_;  // by node
  std::map<std::pair<SwitchKind, NodeId>, NodeId> variables_;  // by kind and argument
  std::vector<SwitchKind> kinds_;
  std::vector<NodeId> arguments_;
};

}  // namespace polyest::internal::equations
