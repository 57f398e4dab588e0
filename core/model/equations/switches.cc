#include "core/model/equations/switches.h"

#include <algorithm>
#include <utility>

namespace polyest::internal::equations {
namespace {

bool Switches(Operation operation) {
  switch (operation) {
    case Operation::kAbsolute:
    case Operation::kSign:
    case Operation::kFloor:
    case Operation::kCeiling:
    case Operation::kMinimum:
    case Operation::kMaximum:
    case Operation::kModulo:
    case Operation::kLess:
    case Operation::kLessOrEqual:
      return true;
    default:
      return false;
  }
}

}  // namespace

bool MaySwitch(const Graph& graph, const std::vector<NodeId>& roots) {
  const std::vector<NodeId> nodes = graph.Reachable(roots);
  return std::any_of(nodes.begin(), nodes.end(),
                     [&](NodeId id) { return Switches(graph.node(id).operation); });
}

bool DependOn(const Graph& graph, const std::vector<NodeId>& roots, NodeId variable) {
  const std::vector<NodeId> nodes = graph.Reachable(roots);
  return std::binary_search(nodes.begin(), nodes.end(), variable);
}

SwitchFreezer::SwitchFreezer(Graph& graph, NodeId time, NodeId frozen_time,
                             std::vector<NodeId> parameters, std::function<NodeId()> make_mode)
    : graph_(graph), make_mode_(std::move(make_mode)), parameters_(std::move(parameters)) {
  std::sort(parameters_.begin(), parameters_.end());
  rewritten_[time] = frozen_time;
}

std::vector<NodeId> SwitchFreezer::Freeze(const std::vector<NodeId>& roots, bool add) {
  add_ = add;
  for (const NodeId id : graph_.Reachable(roots)) {
    if (rewritten_.contains(id)) continue;
    const Node node = graph_.node(id);
    rewritten_[id] = Operands(node.operation) == 0 ? id : Rewrite(node, id);
  }
  std::vector<NodeId> frozen;
  for (const NodeId root : roots) frozen.push_back(rewritten_.at(root));
  return frozen;
}

NodeId SwitchFreezer::Rewrite(const Node& node, NodeId old) {
  NodeId operands[3] = {-1, -1, -1};
  bool changed = false;
  for (int i = 0; i < 3; ++i) {
    if (node.operands[i] < 0) continue;
    operands[i] = rewritten_.at(node.operands[i]);
    changed = changed || operands[i] != node.operands[i];
  }
  if (Switches(node.operation)) {
    const NodeId frozen = Switch(node.operation, operands[0], operands[1]);
    if (frozen >= 0) return frozen;
  }
  if (!changed) return old;
  if (IsLookup(node.operation)) {
    return graph_.Look(node.operation, node.index, operands[0], operands[1]);
  }
  return Make(node.operation, operands[0], operands[1], operands[2]);
}

// Returns the frozen operation, or −1 if it does not switch.
NodeId SwitchFreezer::Switch(Operation operation, NodeId a, NodeId b) {
  Mode mode;
  switch (operation) {
    case Operation::kSign:
      return SignOf(a, mode) ? Sign(mode) : -1;
    case Operation::kAbsolute:
      return SignOf(a, mode) ? Make(Operation::kMultiply, Sign(mode), a) : -1;
    case Operation::kFloor:
      return FloorOf(a, mode) ? mode.variable : -1;
    case Operation::kCeiling:
      return FloorOf(a, mode) ? Make(Operation::kAdd, mode.variable, Graph::kOne) : -1;
    case Operation::kModulo:
      if (!FloorOf(Make(Operation::kDivide, a, b), mode)) return -1;
      return Make(Operation::kSubtract, a, Make(Operation::kMultiply, b, mode.variable));
    default:
      break;
  }
  if (!SignOf(Make(Operation::kSubtract, a, b), mode)) return -1;
  const NodeId less = IsNegative(mode);
  if (operation == Operation::kMinimum) return Make(Operation::kSelect, less, a, b);
  if (operation == Operation::kMaximum) return Make(Operation::kSelect, less, b, a);
  return less;
}

// Finds the mode of the sign of the argument, without constant factors.
bool SwitchFreezer::SignOf(NodeId argument, Mode& mode) {
  for (;;) {
    const Node& node = graph_.node(argument);
    if (node.operation == Operation::kNegate) {
      mode.negative = !mode.negative;
      argument = node.operands[0];
    } else if (node.operation == Operation::kMultiply && graph_.IsConstant(node.operands[0])) {
      if (graph_.node(node.operands[0]).value < 0) mode.negative = !mode.negative;
      argument = node.operands[1];
    } else {
      break;
    }
  }
  const Node node = graph_.node(argument);
  if (node.operation == Operation::kSubtract) {
    // a − b and b − a share a switch.
    const NodeId reversed = Make(Operation::kSubtract, node.operands[1], node.operands[0]);
    if (reversed < argument) {
      mode.negative = !mode.negative;
      argument = reversed;
    }
  }
  return Find(SwitchKind::kSign, argument, mode);
}

bool SwitchFreezer::FloorOf(NodeId argument, Mode& mode) {
  return Find(SwitchKind::kFloor, argument, mode);
}

bool SwitchFreezer::Find(SwitchKind kind, NodeId argument, Mode& mode) {
  const auto known = variables_.find({kind, argument});
  if (known != variables_.end()) {
    mode.variable = known->second;
    return true;
  }
  if (!add_ || !Varies(argument)) return false;
  mode.variable = make_mode_();
  variables_[{kind, argument}] = mode.variable;
  kinds_.push_back(kind);
  arguments_.push_back(argument);
  return true;
}

NodeId SwitchFreezer::Sign(const Mode& mode) {
  return mode.negative ? Make(Operation::kNegate, mode.variable) : mode.variable;
}

NodeId SwitchFreezer::IsNegative(const Mode& mode) {
  return mode.negative ? Make(Operation::kLess, Graph::kZero, mode.variable)
                       : Make(Operation::kLess, mode.variable, Graph::kZero);
}

// Whether the value changes along a trajectory. Operands have lower indices than their node.
bool SwitchFreezer::Varies(NodeId id) {
  for (NodeId next = static_cast<NodeId>(varies_.size()); next <= id; ++next) {
    const Node& node = graph_.node(next);
    bool varies = node.operation == Operation::kVariable &&
                  !std::binary_search(parameters_.begin(), parameters_.end(), next);
    for (const NodeId operand : node.operands) {
      varies = varies || (operand >= 0 && varies_[static_cast<size_t>(operand)]);
    }
    varies_.push_back(varies);
  }
  return varies_[static_cast<size_t>(id)];
}

}  // namespace polyest::internal::equations
