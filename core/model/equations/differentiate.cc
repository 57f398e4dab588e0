#include "core/model/equations/differentiate.h"

#include <numbers>

namespace polyest::internal::equations {
namespace {

// Differentiates nodes with respect to one variable, given the derivatives of their operands.
class ChainRule {
 public:
  explicit ChainRule(Graph& graph) : graph_(graph) {}

  // Returns the derivative dy of node y from the derivatives da, db, dc of its operands.
  NodeId Of(NodeId y, NodeId da, NodeId db, NodeId dc) {
    const Node node = graph_.node(y);
    const auto [a, b, c] = node.operands;
    if (IsLookup(node.operation)) return OfLookup(node, da, db);
    switch (Operands(node.operation)) {
      case 1:
        return da == Graph::kZero ? da : OfUnary(node.operation, y, a, da);
      case 2:
        return da == db && da == Graph::kZero ? da : OfBinary(node.operation, y, a, b, da, db);
      default:
        return node.operation == Operation::kSelect ? Make(Operation::kSelect, a, db, dc)
                                                    : Graph::kZero;
    }
  }

 private:
  NodeId Make(Operation operation, NodeId a, NodeId b = -1, NodeId c = -1) {
    return graph_.Apply(operation, a, b, c);
  }
  NodeId Add(NodeId a, NodeId b) { return Make(Operation::kAdd, a, b); }
  NodeId Subtract(NodeId a, NodeId b) { return Make(Operation::kSubtract, a, b); }
  NodeId Multiply(NodeId a, NodeId b) { return Make(Operation::kMultiply, a, b); }
  NodeId Divide(NodeId a, NodeId b) { return Make(Operation::kDivide, a, b); }
  NodeId Negate(NodeId a) { return Make(Operation::kNegate, a); }
  NodeId Square(NodeId a) { return Multiply(a, a); }

  NodeId OfUnary(Operation operation, NodeId y, NodeId a, NodeId da);
  NodeId OfBinary(Operation operation, NodeId y, NodeId a, NodeId b, NodeId da, NodeId db);
  NodeId OfPower(NodeId y, NodeId a, NodeId b, NodeId da, NodeId db);
  NodeId OfLookup(const Node& node, NodeId da, NodeId db);

  Graph& graph_;
};

NodeId ChainRule::OfUnary(Operation operation, NodeId y, NodeId a, NodeId da) {
  constexpr NodeId one = Graph::kOne;
  switch (operation) {
    case Operation::kNegate:
      return Negate(da);
    case Operation::kAbsolute:
      return Multiply(Make(Operation::kSign, a), da);
    case Operation::kSquareRoot:  // da/(2 √a)
      return Divide(da, Multiply(graph_.Constant(2), y));
    case Operation::kExponential:
      return Multiply(y, da);
    case Operation::kLogarithm:
      return Divide(da, a);
    case Operation::kLogarithm10:  // da/(a ln 10)
      return Divide(da, Multiply(graph_.Constant(std::numbers::ln10), a));
    case Operation::kSine:
      return Multiply(Make(Operation::kCosine, a), da);
    case Operation::kCosine:
      return Negate(Multiply(Make(Operation::kSine, a), da));
    case Operation::kTangent:  // (1 + tan² a) da
      return Multiply(Add(one, Square(y)), da);
    case Operation::kArcSine:  // da/√(1 − a²)
      return Divide(da, Make(Operation::kSquareRoot, Subtract(one, Square(a))));
    case Operation::kArcCosine:
      return Negate(Divide(da, Make(Operation::kSquareRoot, Subtract(one, Square(a)))));
    case Operation::kArcTangent:  // da/(1 + a²)
      return Divide(da, Add(one, Square(a)));
    case Operation::kHyperbolicSine:
      return Multiply(Make(Operation::kHyperbolicCosine, a), da);
    case Operation::kHyperbolicCosine:
      return Multiply(Make(Operation::kHyperbolicSine, a), da);
    case Operation::kHyperbolicTangent:  // (1 − tanh² a) da
      return Multiply(Subtract(one, Square(y)), da);
    default:  // not, sign, floor, ceil: piecewise constant
      return Graph::kZero;
  }
}

NodeId ChainRule::OfBinary(Operation operation, NodeId y, NodeId a, NodeId b, NodeId da,
                           NodeId db) {
  switch (operation) {
    case Operation::kAdd:
      return Add(da, db);
    case Operation::kSubtract:
      return Subtract(da, db);
    case Operation::kMultiply:
      return Add(Multiply(da, b), Multiply(a, db));
    case Operation::kDivide:  // (da − y db)/b
      return Divide(Subtract(da, Multiply(y, db)), b);
    case Operation::kPower:
      return OfPower(y, a, b, da, db);
    case Operation::kMinimum:
      return Make(Operation::kSelect, Make(Operation::kLessOrEqual, a, b), da, db);
    case Operation::kMaximum:
      return Make(Operation::kSelect, Make(Operation::kLessOrEqual, b, a), da, db);
    case Operation::kArcTangent2:  // y = atan2(a, b): (b da − a db)/(a² + b²)
      return Divide(Subtract(Multiply(b, da), Multiply(a, db)), Add(Square(a), Square(b)));
    case Operation::kHypotenuse:  // (a da + b db)/y, and 0 at the origin, as for abs
      return Make(Operation::kSelect, y, Divide(Add(Multiply(a, da), Multiply(b, db)), y),
                  Graph::kZero);
    case Operation::kModulo:  // y = a − b floor(a/b)
      return Subtract(da, Multiply(Make(Operation::kFloor, Divide(a, b)), db));
    default:  // comparisons and logic: piecewise constant
      return Graph::kZero;
  }
}

// Implements d aᵇ = b a^{b−1} da + aᵇ ln a db, where 0ᵇ ln 0 = 0.
NodeId ChainRule::OfPower(NodeId y, NodeId a, NodeId b, NodeId da, NodeId db) {
  NodeId sum = Graph::kZero;
  if (da != Graph::kZero) {
    const NodeId lower = Make(Operation::kPower, a, Subtract(b, Graph::kOne));
    sum = Multiply(Multiply(b, lower), da);
  }
  if (db == Graph::kZero) return sum;
  const NodeId rate = Multiply(y, Make(Operation::kLogarithm, a));
  return Add(sum, Multiply(Make(Operation::kSelect, y, rate, Graph::kZero), db));
}

NodeId ChainRule::OfLookup(const Node& node, NodeId da, NodeId db) {
  // A slope is never differentiated: only values are.
  if (node.operation != Operation::kLookup) return Graph::kZero;
  const auto [x, y, none] = node.operands;
  NodeId sum = Graph::kZero;
  if (da != Graph::kZero) {
    sum = Multiply(graph_.Look(Operation::kLookupSlopeX, node.index, x, y), da);
  }
  if (db == Graph::kZero) return sum;
  return Add(sum, Multiply(graph_.Look(Operation::kLookupSlopeY, node.index, x, y), db));
}

}  // namespace

std::vector<NodeId> Differentiate(Graph& graph, const std::vector<NodeId>& roots,
                                  const std::vector<NodeId>& variables) {
  const std::vector<NodeId> order = graph.Reachable(roots);
  ChainRule chain_rule(graph);
  std::vector<NodeId> derivative(static_cast<size_t>(graph.size()), Graph::kZero);
  std::vector<NodeId> result;
  for (const NodeId variable : variables) {
    for (const NodeId id : order) {
      NodeId d[3];
      for (int i = 0; i < 3; ++i) {
        const NodeId operand = graph.node(id).operands[i];
        d[i] = operand < 0 ? Graph::kZero : derivative[static_cast<size_t>(operand)];
      }
      derivative[static_cast<size_t>(id)] = id == variable ? Graph::kOne
                                            : Operands(graph.node(id).operation) == 0
                                                ? Graph::kZero
                                                : chain_rule.Of(id, d[0], d[1], d[2]);
      if (graph.exhausted()) return {};
    }
    for (const NodeId root : roots) result.push_back(derivative[static_cast<size_t>(root)]);
  }
  return result;
}

}  // namespace polyest::internal::equations
