#include "core/model/equations/graph.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/common/check.h"
#include "core/model/equations/kernels.h"

namespace polyest::internal::equations {
namespace {

constexpr int kMaxFactors = 16;  // largest power that is written as a product

}  // namespace

size_t Graph::Hash::operator()(const Node& node) const {
  std::uint64_t hash = static_cast<std::uint64_t>(node.operation);
  const auto mix = [&hash](std::uint64_t part) {
    hash = (hash ^ part) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  };
  for (const NodeId operand : node.operands) mix(static_cast<std::uint32_t>(operand));
  mix(static_cast<std::uint32_t>(node.index));
  mix(std::bit_cast<std::uint64_t>(node.value));
  return static_cast<size_t>(hash);
}

Graph::Graph(int max_nodes) : max_nodes_(max_nodes) {
  POLYEST_CHECK(max_nodes > 2);
  POLYEST_CHECK(Constant(0) == kZero && Constant(1) == kOne);
}

NodeId Graph::Intern(const Node& node) {
  if (const auto known = ids_.find(node); known != ids_.end()) return known->second;
  if (size() >= max_nodes_) {
    exhausted_ = true;
    return kZero;
  }
  const NodeId id = size();
  nodes_.push_back(node);
  ids_.emplace(node, id);
  return id;
}

NodeId Graph::Constant(double value) {
  POLYEST_CHECK(std::isfinite(value));
  // 0 and −0 compare equal and must be the same node.
  return Intern({.operation = Operation::kConstant, .value = value == 0 ? 0.0 : value});
}

NodeId Graph::Variable(int index) {
  return Intern({.operation = Operation::kVariable, .index = index});
}

NodeId Graph::Look(Operation operation, int table, NodeId x, NodeId y) {
  POLYEST_CHECK(IsLookup(operation));
  return Intern({.operation = operation, .operands = {x, y, -1}, .index = table});
}

NodeId Graph::Raw(Operation operation, NodeId a, NodeId b, NodeId c) {
  if (IsCommutative(operation)) {
    // Constants come first, then nodes by their index.
    const auto rank = [this](NodeId id) { return std::make_pair(!IsConstant(id), id); };
    if (rank(b) < rank(a)) std::swap(a, b);
  }
  return Intern({.operation = operation, .operands = {a, b, c}});
}

NodeId Graph::Apply(Operation operation, NodeId a, NodeId b, NodeId c) {
  if (exhausted_) return kZero;
  const int operands = Operands(operation);
  const bool constant =
      IsConstant(a) && (operands < 2 || IsConstant(b)) && (operands < 3 || IsConstant(c));
  if (constant) {
    const double value = EvaluateAtPoint(operation, node(a).value, operands < 2 ? 0 : node(b).value,
                                         operands < 3 ? 0 : node(c).value);
    return std::isfinite(value) ? Constant(value) : Raw(operation, a, b, c);
  }
  return Simplify(operation, a, b, c);
}

NodeId Graph::Simplify(Operation operation, NodeId a, NodeId b, NodeId c) {
  switch (operation) {
    case Operation::kNegate:
      return Negate(a);
    case Operation::kAdd:
      return Add(a, b);
    case Operation::kSubtract:
      return Subtract(a, b);
    case Operation::kMultiply:
      return Multiply(a, b);
    case Operation::kDivide:
      return Divide(a, b);
    case Operation::kPower:
      return Power(a, b);
    case Operation::kMinimum:
    case Operation::kMaximum:
      return a == b ? a : Raw(operation, a, b);
    case Operation::kSelect:
      if (IsConstant(a)) return node(a).value != 0 ? b : c;
      return b == c ? b : Raw(operation, a, b, c);
    default:
      return Raw(operation, a, b, c);
  }
}

NodeId Graph::Negate(NodeId a) {
  const Node operand = node(a);
  // −(−x) = x,  −(x − y) = y − x,  −(c x) = (−c) x
  if (operand.operation == Operation::kNegate) return operand.operands[0];
  if (operand.operation == Operation::kSubtract) {
    return Apply(Operation::kSubtract, operand.operands[1], operand.operands[0]);
  }
  if (operand.operation == Operation::kMultiply && IsConstant(operand.operands[0])) {
    return Apply(Operation::kMultiply, Constant(-node(operand.operands[0]).value),
                 operand.operands[1]);
  }
  return Raw(Operation::kNegate, a);
}

NodeId Graph::Add(NodeId a, NodeId b) {
  if (a == kZero) return b;
  if (b == kZero) return a;
  // −x + y = y − x
  if (Is(a, Operation::kNegate)) return Apply(Operation::kSubtract, b, node(a).operands[0]);
  if (Is(b, Operation::kNegate)) return Apply(Operation::kSubtract, a, node(b).operands[0]);
  return Raw(Operation::kAdd, a, b);
}

NodeId Graph::Subtract(NodeId a, NodeId b) {
  if (a == kZero) return Apply(Operation::kNegate, b);
  if (b == kZero) return a;
  if (a == b) return kZero;
  // x − (−y) = x + y,  −x − y = −(x + y)
  if (Is(b, Operation::kNegate)) return Apply(Operation::kAdd, a, node(b).operands[0]);
  if (Is(a, Operation::kNegate)) {
    return Apply(Operation::kNegate, Apply(Operation::kAdd, node(a).operands[0], b));
  }
  return Raw(Operation::kSubtract, a, b);
}

NodeId Graph::Multiply(NodeId a, NodeId b) {
  if (IsConstant(b)) std::swap(a, b);
  if (a == kZero) return kZero;
  if (a == kOne) return b;
  if (IsValue(a, -1)) return Apply(Operation::kNegate, b);
  // (−x) y = −(x y)
  for (int side = 0; side < 2; ++side, std::swap(a, b)) {
    if (!Is(a, Operation::kNegate)) continue;
    return Apply(Operation::kNegate, Apply(Operation::kMultiply, node(a).operands[0], b));
  }
  // c (d x) = (c d) x
  const Node second = node(b);
  if (IsConstant(a) && second.operation == Operation::kMultiply && IsConstant(second.operands[0])) {
    const double product = node(a).value * node(second.operands[0]).value;
    if (std::isnormal(product)) {
      return Apply(Operation::kMultiply, Constant(product), second.operands[1]);
    }
  }
  return Raw(Operation::kMultiply, a, b);
}

NodeId Graph::Divide(NodeId a, NodeId b) {
  if (a == kZero) return kZero;
  if (b == kOne) return a;
  if (IsConstant(b) && std::isnormal(1 / node(b).value)) {
    return Apply(Operation::kMultiply, Constant(1 / node(b).value), a);
  }
  // (−x)/y = −(x/y) = x/(−y)
  for (const NodeId side : {a, b}) {
    if (!Is(side, Operation::kNegate)) continue;
    const NodeId positive = node(side).operands[0];
    return Apply(Operation::kNegate, side == a ? Apply(Operation::kDivide, positive, b)
                                               : Apply(Operation::kDivide, a, positive));
  }
  return Raw(Operation::kDivide, a, b);
}

NodeId Graph::Power(NodeId a, NodeId b) {
  if (a == kOne) return kOne;
  if (!IsConstant(b)) return Raw(Operation::kPower, a, b);
  const double exponent = node(b).value;
  if (exponent == 0.5) return Apply(Operation::kSquareRoot, a);
  if (exponent == std::floor(exponent) && std::abs(exponent) <= kMaxFactors) {
    const NodeId power = IntegerPower(a, static_cast<int>(std::abs(exponent)));
    return exponent < 0 ? Apply(Operation::kDivide, kOne, power) : power;
  }
  return Raw(Operation::kPower, a, b);
}

// x⁰ = 1,  x^{2n} = (xⁿ)²,  x^{2n+1} = (xⁿ)² x
NodeId Graph::IntegerPower(NodeId a, int exponent) {
  if (exponent == 0) return kOne;
  if (exponent == 1) return a;
  const NodeId half = IntegerPower(a, exponent / 2);
  const NodeId square = Apply(Operation::kMultiply, half, half);
  return exponent % 2 == 0 ? square : Apply(Operation::kMultiply, square, a);
}

std::vector<NodeId> Graph::Reachable(const std::vector<NodeId>& roots) const {
  std::vector<bool> reachable(nodes_.size(), false);
  for (const NodeId root : roots) reachable[static_cast<size_t>(root)] = true;
  std::vector<NodeId> order;
  for (NodeId id = size(); id-- > 0;) {
    if (!reachable[static_cast<size_t>(id)]) continue;
    order.push_back(id);
    for (const NodeId operand : node(id).operands) {
      if (operand >= 0) reachable[static_cast<size_t>(operand)] = true;
    }
  }
  std::ranges::reverse(order);
  return order;
}

}  // namespace polyest::internal::equations
