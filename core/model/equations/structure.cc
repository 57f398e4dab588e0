#include "core/model/equations/structure.h"

#include <algorithm>

namespace polyest::internal::equations {
namespace {

Form FormOfProduct(Form a, Form b) {
  if (a == Form::kZero || b == Form::kZero) return Form::kZero;
  if (a == Form::kFixed) return b;
  return b == Form::kFixed ? a : Form::kOther;
}

// Returns the form of an operation from those of its operands; those that it lacks are kZero.
Form FormOf(Operation operation, Form a, Form b, Form c) {
  switch (operation) {
    case Operation::kNegate:
      return a;
    case Operation::kAdd:
    case Operation::kSubtract:
      return std::max(a, b);
    case Operation::kMultiply:
      return FormOfProduct(a, b);
    case Operation::kDivide:
      return b == Form::kFixed ? a : Form::kOther;
    case Operation::kSelect:
      return a <= Form::kFixed ? std::max(b, c) : Form::kOther;
    default:
      return std::max({a, b, c}) <= Form::kFixed ? Form::kFixed : Form::kOther;
  }
}

}  // namespace

Structure::Structure(const Graph& graph, const std::vector<NodeId>& roots) {
  std::vector<NodeId> place(static_cast<size_t>(graph.size()), -1);
  std::vector<bool> needed(place.size(), false);
  for (const NodeId root : roots) needed[static_cast<size_t>(root)] = true;
  for (NodeId id = graph.size(); id-- > 0;) {
    if (!needed[static_cast<size_t>(id)]) continue;
    for (const NodeId operand : graph.node(id).operands) {
      if (operand >= 0) needed[static_cast<size_t>(operand)] = true;
    }
  }
  for (size_t id = 0; id < place.size(); ++id) {
    if (!needed[id]) continue;
    Node node = graph.node(static_cast<NodeId>(id));
    for (NodeId& operand : node.operands) {
      if (operand >= 0) operand = place[static_cast<size_t>(operand)];
    }
    place[id] = static_cast<NodeId>(nodes_.size());
    nodes_.push_back(node);
  }
  for (const NodeId root : roots) roots_.push_back(place[static_cast<size_t>(root)]);
}

Form Structure::Highest(const std::vector<Form>& variables) const {
  std::vector<Form> forms;
  forms.reserve(nodes_.size());
  const auto of = [&forms](NodeId operand) {
    return operand < 0 ? Form::kZero : forms[static_cast<size_t>(operand)];
  };
  for (const Node& node : nodes_) {
    if (node.operation == Operation::kConstant) {
      forms.push_back(node.value == 0 ? Form::kZero : Form::kFixed);
    } else if (node.operation == Operation::kVariable) {
      forms.push_back(variables[static_cast<size_t>(node.index)]);
    } else {
      const auto [a, b, c] = node.operands;
      forms.push_back(FormOf(node.operation, of(a), of(b), of(c)));
    }
  }
  Form highest = Form::kZero;
  for (const NodeId root : roots_) highest = std::max(highest, of(root));
  return highest;
}

bool Structure::Uses(int variable) const {
  return std::ranges::any_of(nodes_, [variable](const Node& node) {
    return node.operation == Operation::kVariable && node.index == variable;
  });
}

}  // namespace polyest::internal::equations
