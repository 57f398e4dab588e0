#pragma once

// A graph of expressions in which equal subexpressions are one node.
//
// Every added expression is first brought to a canonical form: constants are folded, negations
// moved outwards, operands of commutative operations sorted, and small integer powers written as
// products. Two of the rewritings may change the result by one rounding each: a product of
// constants is multiplied first (c·(d·x) = (c·d)·x), and a division by a constant becomes a product
// (x/c = (1/c)·x). A power written as a product rounds once for each multiplication.

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "core/model/equations/operation.h"

namespace polyest::internal::equations {

// The index of a node in its graph. The operands of a node have lower indices.
using NodeId = int;

struct Node {
  Operation operation = Operation::kConstant;
  NodeId operands[3] = {-1, -1, -1};
  int index = 0;     // of a variable, or of the table of a lookup
  double value = 0;  // value of a constant

  bool operator==(const Node&) const = default;
};

class Graph {
 public:
  static constexpr NodeId kZero = 0;
  static constexpr NodeId kOne = 1;

  // Makes a graph of at most `max_nodes` nodes, more than 2. It holds kZero and kOne already.
  explicit Graph(int max_nodes);

  // Each of these returns the node of the expression in its canonical form.
  NodeId Constant(double value);  // `value` must be finite
  NodeId Variable(int index);
  NodeId Apply(Operation operation, NodeId a, NodeId b = -1, NodeId c = -1);
  NodeId Look(Operation operation, int table, NodeId x, NodeId y = -1);

  // Whether a node was refused because the graph is full. From then on every added expression is
  // kZero.
  bool exhausted() const { return exhausted_; }
  // Changes the maximum number of nodes.
  void set_most_nodes(int max_nodes) { max_nodes_ = max_nodes; }

  int size() const { return static_cast<int>(nodes_.size()); }
  const Node& node(NodeId id) const { return nodes_[static_cast<size_t>(id)]; }
  bool IsConstant(NodeId id) const { return node(id).operation == Operation::kConstant; }
  // Returns the nodes that the roots depend on, and the roots, operands first.
  std::vector<NodeId> Reachable(const std::vector<NodeId>& roots) const;

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
