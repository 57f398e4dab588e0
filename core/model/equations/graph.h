#pragma once

// Expressions as a graph in which equal subexpressions are one node.
//
// Whatever is added is first brought to a canonical form: constants are folded, negations drawn
// outwards, operands of commutative operations put in order, small integer powers written as
// products. All of this is exact in floating point, but for a product of constants taken first
// (c·(d·x) = (c·d)·x) and a division by a constant (x/c = (1/c)·x), a rounding each.

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "core/model/equations/operation.h"

namespace polyest::internal::equations {

// Of a node in its graph. The operands of a node come before it.
using NodeId = int;

struct Node {
  Operation operation = Operation::kConstant;
  NodeId operands[3] = {-1, -1, -1};
  int index = 0;     // of a variable, or of a lookup's table
  double value = 0;  // of a constant

  bool operator==(const Node&) const = default;
};

class Graph {
 public:
  static constexpr NodeId kZero = 0;
  static constexpr NodeId kOne = 1;

  explicit Graph(int max_nodes);

  NodeId Constant(double value);  // finite
  NodeId Variable(int index);
  NodeId Apply(Operation operation, NodeId a, NodeId b = -1, NodeId c = -1);
  NodeId Look(Operation operation, int table, NodeId x, NodeId y = -1);

  // There was no room for a node: what was asked for since is kZero.
  bool exhausted() const { return exhausted_; }
  void set_most_nodes(int max_nodes) { max_nodes_ = max_nodes; }

  int size() const { return static_cast<int>(nodes_.size()); }
  const Node& node(NodeId id) const { return nodes_[static_cast<size_t>(id)]; }
  bool IsConstant(NodeId id) const { return node(id).operation == Operation::kConstant; }

 private:
  struct Hash {
    size_t operator()(const Node& node) const;
  };

  NodeId Intern(const Node& node);
  NodeId Simplify(Operation operation, NodeId a, NodeId b, NodeId c);
  NodeId Negate(NodeId a);
  NodeId Add(NodeId a, NodeId b);
  NodeId Subtract(NodeId a, NodeId b);
  NodeId Multiply(NodeId a, NodeId b);
  NodeId Divide(NodeId a, NodeId b);
  NodeId Power(NodeId a, NodeId b);
  NodeId IntegerPower(NodeId a, int exponent);
  NodeId Raw(Operation operation, NodeId a, NodeId b = -1, NodeId c = -1);
  bool Is(NodeId id, Operation operation) const { return node(id).operation == operation; }
  bool IsValue(NodeId id, double value) const { return IsConstant(id) && node(id).value == value; }

  int max_nodes_;
  bool exhausted_ = false;
  std::vector<Node> nodes_;
  std::unordered_map<Node, NodeId, Hash> ids_;
};

}  // namespace polyest::internal::equations
