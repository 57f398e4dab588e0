#include "core/model/equations/steps.h"

#include <algorithm>
#include <map>
#include <span>
#include <utility>

namespace polyest::internal::equations {
namespace {

Step MakeStep(Operation operation, std::span<const NodeId> operands) {
  Step step{.operation = operation};
  step.operands.fill(-1);
  std::ranges::copy(operands, step.operands.begin());
  return step;
}

class StepMaker {
 public:
  StepMaker(const Graph& graph, const std::vector<NodeId>& roots,
            const std::vector<VariablePlace>& places, int parameters)
      : graph_(graph), roots_(roots), places_(places), parameters_(parameters) {}

  std::vector<Step> Make() {
    CountUses();
    FindThoseOfParameters();
    TakeReciprocals();
    Fuse();
    FormPairs();
    return std::move(steps_);
  }

 private:
  Step& step(NodeId id) { return steps_[static_cast<size_t>(id)]; }

  void CountUses();
  void FindThoseOfParameters();
  void TakeReciprocals();
  NodeId ReciprocalOf(NodeId divisor);
  void Fuse();
  bool FuseProduct(NodeId sum, Operation operation, NodeId product, NodeId other);
  bool MayFuse(NodeId outer, NodeId inner);
  void FormPairs();
  void FormPair(NodeId id, int position);

  const Graph& graph_;
  const std::vector<NodeId>& roots_;
  const std::vector<VariablePlace>& places_;
  const int parameters_;
  std::vector<Step> steps_;
  std::map<NodeId, NodeId> reciprocals_;
};

void StepMaker::CountUses() {
  for (NodeId id = 0; id < graph_.size(); ++id) {
    const Node& node = graph_.node(id);
    steps_.push_back(MakeStep(node.operation, node.operands));
  }
  for (const NodeId root : roots_) {
    step(root).needed = true;
    ++step(root).uses;
  }
  for (NodeId id = graph_.size(); id-- > 0;) {
    if (!step(id).needed) continue;
    for (const NodeId operand : step(id).operands) {
      if (operand < 0) continue;
      step(operand).needed = true;
      ++step(operand).uses;
    }
  }
}

void StepMaker::FindThoseOfParameters() {
  for (NodeId id = 0; id < graph_.size(); ++id) {
    const Node& node = graph_.node(id);
    if (node.operation == Operation::kVariable) {
      step(id).of_parameters = places_[static_cast<size_t>(node.index)].block == parameters_;
      continue;
    }
    bool any = false, others = false;
    for (const NodeId operand : node.operands) {
      if (operand < 0) continue;
      any = any || step(operand).of_parameters;
      others = others || !(step(operand).of_parameters || graph_.IsConstant(operand));
    }
    step(id).of_parameters = any && !others;
  }
}

// Makes x/p, where only p is of the parameters alone, x (1/p).
void StepMaker::TakeReciprocals() {
  for (NodeId id = 0; id < graph_.size(); ++id) {
    const NodeId p = step(id).operands[1];
    if (!step(id).needed || step(id).operation != Operation::kDivide || step(id).of_parameters ||
        !step(p).of_parameters) {
      continue;
    }
    const NodeId reciprocal = ReciprocalOf(p);
    --step(p).uses;
    ++step(reciprocal).uses;
    step(id).operation = Operation::kMultiply;
    step(id).operands[1] = reciprocal;
  }
}

NodeId StepMaker::ReciprocalOf(NodeId divisor) {
  const auto [found, is_new] =
      reciprocals_.try_emplace(divisor, static_cast<NodeId>(steps_.size()));
  if (is_new) {
    steps_.push_back(MakeStep(Operation::kDivide, std::array{Graph::kOne, divisor}));
    steps_.back().needed = steps_.back().of_parameters = true;
    ++step(divisor).uses;
    ++step(Graph::kOne).uses;
  }
  return found->second;
}

void StepMaker::Fuse() {
  for (NodeId id = 0; id < graph_.size(); ++id) {
    if (!step(id).needed) continue;
    const NodeId a = step(id).operands[0], b = step(id).operands[1];
    if (step(id).operation == Operation::kAdd) {
      FuseProduct(id, Operation::kMultiplyAdd, a, b) ||
          FuseProduct(id, Operation::kMultiplyAdd, b, a);
    } else if (step(id).operation == Operation::kSubtract) {
      FuseProduct(id, Operation::kSubtractMultiplied, b, a) ||
          FuseProduct(id, Operation::kMultiplySubtract, a, b);
    }
  }
}

// Fuses `product` into `sum`: makes `sum` the operation on the factors of `product` and the other
// term. Returns false if `product` is not a product or must be computed by itself.
bool StepMaker::FuseProduct(NodeId sum, Operation operation, NodeId product, NodeId other) {
  if (step(product).operation != Operation::kMultiply || !MayFuse(sum, product)) return false;
  const NodeId a = step(product).operands[0], b = step(product).operands[1];
  step(sum).operation = operation;
  step(sum).operands[0] = a;
  step(sum).operands[1] = b;
  step(sum).operands[2] = other;
  return true;
}

// Returns whether what `outer` reads need not be computed by itself: it has no other uses, and is
// not kept from run to run.
bool StepMaker::MayFuse(NodeId outer, NodeId inner) {
  return step(inner).uses == 1 && (!step(inner).of_parameters || step(outer).of_parameters);
}

void StepMaker::FormPairs() {
  for (NodeId id = 0; id < graph_.size(); ++id) {
    if (!step(id).needed) continue;
    for (int i = 0; i < Operands(step(id).operation) && !step(id).inner.has_value(); ++i) {
      FormPair(id, i);
    }
  }
}

// Lets one instruction compute the operand at a position, too, if there is a kernel for that.
void StepMaker::FormPair(NodeId id, int position) {
  Step& outer = step(id);
  const Step& inner = step(outer.operands[position]);
  if (inner.inner.has_value() || !MayFuse(id, outer.operands[position])) return;
  // The terms of a sum and the factors of a product may change places.
  const int at = position == 1 && outer.operation != Operation::kSubtract ? 0 : position;
  if (SelectPair(inner.operation, outer.operation, at) == nullptr) return;
  std::vector<NodeId> operands(inner.operands.begin(),
                               inner.operands.begin() + Operands(inner.operation));
  for (int i = 0; i < Operands(outer.operation); ++i) {
    if (i != position) operands.push_back(outer.operands[i]);
  }
  std::ranges::copy(operands, outer.operands.begin());
  outer.inner = Inner{inner.operation, at};
}

}  // namespace

std::vector<Step> MakeSteps(const Graph& graph, const std::vector<NodeId>& roots,
                            const std::vector<VariablePlace>& places, int parameters) {
  return StepMaker(graph, roots, places, parameters).Make();
}

}  // namespace polyest::internal::equations
