// Compiles graphs into programs.

#include <algorithm>
#include <atomic>

#include "core/common/check.h"
#include "core/model/equations/program.h"
#include "core/model/equations/steps.h"

namespace polyest::internal::equations {
namespace {

// Most values of parameters alone that are kept; each takes 512 bytes per thread.
constexpr std::uint32_t kMaxKept = 512;

}  // namespace

class ProgramBuilder {
 public:
  ProgramBuilder(const Graph& graph, const std::vector<NodeId>& roots,
                 const std::vector<VariablePlace>& places, const std::vector<Lookup>& tables,
                 int parameters)
      : graph_(graph),
        roots_(roots),
        places_(places),
        tables_(tables),
        parameters_(parameters),
        steps_(MakeSteps(graph, roots, places, parameters)) {}

  Program Build() {
    static std::atomic<std::int64_t> count = 0;
    program_.id_ = ++count;
    for (const NodeId root : roots_) Order(root);
    FindThoseOfTime();
    FindWhatIsKept();
    PlaceOperands();
    PlaceResults();
    Emit();
    return std::move(program_);
  }

 private:
  Step& step(NodeId id) { return steps_[static_cast<size_t>(id)]; }
  const Step& step(NodeId id) const { return steps_[static_cast<size_t>(id)]; }
  bool IsLeaf(NodeId id) const { return Operands(step(id).operation) == 0; }

  void Order(NodeId root);
  void FindThoseOfTime();
  void FindWhatIsKept();
  void PlaceOperands();
  void PlaceLeaf(NodeId id);
  void PlaceResults();
  void Emit();
  void EmitStep(NodeId id, int position);
  void NoteParameterColumns();
  Instruction InstructionOf(NodeId id) const;
  // Returns the mask of the rows of a slot, see Instruction.
  std::int32_t MaskOf(std::uint32_t slot) const {
    return slot < 1 + program_.constants_.size() + static_cast<size_t>(of_time_) ? 0 : ~0;
  }

  const Graph& graph_;
  const std::vector<NodeId>& roots_;
  const std::vector<VariablePlace>& places_;
  const std::vector<Lookup>& tables_;
  const int parameters_;
  std::vector<Step> steps_;
  std::vector<NodeId> order_;  // the nodes to compute, operands first
  int of_time_ = 0;            // number of steps of the time alone
  std::vector<std::uint32_t> free_registers_;
  Program program_;
};

// Appends the nodes that `root` depends on and that are not yet in the order, operands first,
// without recursion.
void ProgramBuilder::Order(NodeId root) {
  std::vector<std::pair<NodeId, int>> path = {{root, 0}};
  while (!path.empty()) {
    auto& [id, next] = path.back();
    if (IsLeaf(id) || step(id).last_use >= 0) {
      path.pop_back();
      continue;
    }
    if (next < Instruction::kMaxOperands && step(id).operands[next] >= 0) {
      path.emplace_back(step(id).operands[next++], 0);
      continue;
    }
    // Initial value for a node that no other reads, such as a root; PlaceResults raises it for the
    // others.
    step(id).last_use = static_cast<int>(order_.size());
    order_.push_back(id);
    path.pop_back();
  }
}

void ProgramBuilder::FindThoseOfTime() {
  const auto depends_on_time_only = [this](NodeId id) {
    if (step(id).operation == Operation::kConstant) return true;
    if (step(id).operation != Operation::kVariable) return step(id).of_time;
    const auto variable = static_cast<size_t>(graph_.node(id).index);
    return places_[variable].block == VariablePlace::kTime;
  };
  for (const NodeId id : order_) {
    Step& current = step(id);
    current.of_time = std::ranges::all_of(current.operands, [&](NodeId operand) {
      return operand < 0 || depends_on_time_only(operand);
    });
    if (current.of_time) ++of_time_;
  }
}

void ProgramBuilder::FindWhatIsKept() {
  std::uint32_t kept = 0;
  const auto keep = [&](NodeId id) {
    Step& value = step(id);
    if (!value.of_parameters || IsLeaf(id) || value.kept) return;
    value.kept = true;
    ++kept;
  };
  for (const NodeId root : roots_) keep(root);
  for (const NodeId id : order_) {
    if (step(id).of_parameters) continue;
    for (const NodeId operand : step(id).operands) {
      if (operand >= 0) keep(operand);
    }
  }
  if (kept > kMaxKept) {
    for (Step& one : steps_) one.of_parameters = one.kept = false;
  }
}

void ProgramBuilder::PlaceLeaf(NodeId id) {
  if (step(id).slot != kNowhere) return;
  if (graph_.IsConstant(id)) {
    program_.constants_.push_back(Lane::Constant(graph_.node(id).value));
    step(id).slot = static_cast<std::uint32_t>(program_.constants_.size());
    return;
  }
  const VariablePlace& place = places_[static_cast<size_t>(graph_.node(id).index)];
  if (place.block == VariablePlace::kTime) {
    step(id).slot = 0;
    return;
  }
  program_.loads_.push_back({kNowhere, place});
  step(id).slot = static_cast<std::uint32_t>(program_.loads_.size() - 1);
}

// Places the constants first, because the slots of the steps of the time alone, those of what is
// kept and then those of the loads begin where those of the constants end.
void ProgramBuilder::PlaceOperands() {
  std::vector<NodeId> leaves;
  for (const NodeId id : order_) {
    for (const NodeId operand : step(id).operands) {
      if (operand >= 0 && IsLeaf(operand)) leaves.push_back(operand);
    }
  }
  for (const NodeId root : roots_) {
    if (IsLeaf(root) && root != Graph::kZero) leaves.push_back(root);
  }
  for (const NodeId id : leaves) {
    if (graph_.IsConstant(id)) PlaceLeaf(id);
  }
  auto first_load = 1 + static_cast<std::uint32_t>(program_.constants_.size());
  for (const NodeId id : order_) {
    if (step(id).of_time) step(id).slot = first_load++;
  }
  program_.first_kept_ = first_load;
  for (const NodeId id : order_) {
    if (step(id).kept) step(id).slot = first_load++;
  }
  program_.kept_ = first_load - program_.first_kept_;
  for (const NodeId id : leaves) {
    if (graph_.IsConstant(id) || step(id).slot != kNowhere) continue;
    const size_t loads = program_.loads_.size();
    PlaceLeaf(id);
    if (program_.loads_.size() == loads) continue;  // the time has a slot of its own
    step(id).slot += first_load;
    program_.loads_.back().slot = step(id).slot;
  }
  program_.first_result_ = first_load + static_cast<std::uint32_t>(program_.loads_.size());
  program_.first_register_ = program_.first_result_ + static_cast<std::uint32_t>(roots_.size());
}

// Computes each root directly into its column of the results.
void ProgramBuilder::PlaceResults() {
  for (size_t i = 0; i < roots_.size(); ++i) {
    Step& root = step(roots_[i]);
    if (IsLeaf(roots_[i]) || root.slot != kNowhere) continue;
    root.slot = program_.first_result_ + static_cast<std::uint32_t>(i);
  }
  for (size_t position = 0; position < order_.size(); ++position) {
    for (const NodeId operand : step(order_[position]).operands) {
      if (operand >= 0) step(operand).last_use = static_cast<int>(position);
    }
  }
}

// Returns the instruction that computes a node whose operands and result have slots.
Instruction ProgramBuilder::InstructionOf(NodeId id) const {
  const Step& current = step(id);
  Instruction instruction{};
  for (int i = 0; i < Instruction::kMaxOperands; ++i) {
    // A missing operand is replaced by the first one.
    const NodeId operand = current.operands[current.operands[i] < 0 ? 0 : i];
    instruction.operands[i] = step(operand).slot;
    instruction.masks[i] = MaskOf(step(operand).slot);
  }
  instruction.result = current.slot;
  instruction.kernel =
      current.inner.has_value()
          ? SelectPair(current.inner->operation, current.operation, current.inner->position)
          : SelectKernel(current.operation);
  if (IsLookup(current.operation)) {
    instruction.lookup = &tables_[static_cast<size_t>(graph_.node(id).index)];
  }
  return instruction;
}

// Frees the registers of operands that are not read any more, and gives the node one if it has no
// slot yet.
void ProgramBuilder::EmitStep(NodeId id, int position) {
  Step& current = step(id);
  for (const NodeId operand : current.operands) {
    if (operand < 0) continue;
    Step& source = step(operand);
    if (source.last_use == position && source.slot >= program_.first_register_) {
      free_registers_.push_back(source.slot);
      source.last_use = -1;  // frees the register only once
    }
  }
  if (current.slot == kNowhere) {
    if (free_registers_.empty()) {
      free_registers_.push_back(program_.first_register_ +
                                static_cast<std::uint32_t>(program_.registers_++));
    }
    current.slot = free_registers_.back();
    free_registers_.pop_back();
  }
  auto& instructions = current.of_parameters ? program_.of_parameters_ : program_.instructions_;
  instructions.push_back(InstructionOf(id));
}

// Emits the steps of the parameters alone before all others: they may use the same registers.
void ProgramBuilder::Emit() {
  for (const bool of_parameters : {true, false}) {
    for (size_t position = 0; position < order_.size(); ++position) {
      const NodeId id = order_[position];
      if (step(id).of_parameters != of_parameters) continue;
      if (step(id).of_time) {
        program_.of_time_.push_back(InstructionOf(id));
      } else {
        EmitStep(id, static_cast<int>(position));
      }
    }
  }
  NoteParameterColumns();
  for (size_t i = 0; i < roots_.size(); ++i) {
    const std::uint32_t column = program_.first_result_ + static_cast<std::uint32_t>(i);
    if (roots_[i] == Graph::kZero) {
      program_.zero_.push_back(static_cast<Eigen::Index>(i));
    } else if (const std::uint32_t slot = step(roots_[i]).slot; slot != column) {
      program_.instructions_.push_back(
          {CopyKernel(), column, {slot, slot, slot, slot, slot}, {MaskOf(slot)}, nullptr});
    }
  }
}

void ProgramBuilder::NoteParameterColumns() {
  program_.parameters_ = parameters_;
  for (const NodeId id : order_) {
    if (!step(id).of_parameters) continue;
    for (const NodeId operand : step(id).operands) {
      if (operand < 0 || step(operand).operation != Operation::kVariable) continue;
      const auto variable = static_cast<size_t>(graph_.node(operand).index);
      program_.parameter_columns_.push_back(places_[variable].column);
    }
  }
  auto& columns = program_.parameter_columns_;
  std::ranges::sort(columns);
  columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
}

Program::Program(const Graph& graph, const std::vector<NodeId>& roots,
                 const std::vector<VariablePlace>& places, const std::vector<Lookup>& tables,
                 int parameters)
    : Program(ProgramBuilder(graph, roots, places, tables, parameters).Build()) {}

}  // namespace polyest::internal::equations
