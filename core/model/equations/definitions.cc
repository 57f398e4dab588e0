#include "core/model/equations/definitions.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <set>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/model/equations/limits.h"
#include "core/model/equations/text_error.h"

namespace polyest::internal::equations {
namespace {

// Sorts definitions by a depth-first search without recursion, which keeps the path from the
// starting definition for the report of a cycle.
class DependencyOrder {
 public:
  explicit DependencyOrder(const std::vector<Definition>& definitions) {
    for (size_t i = 0; i < definitions.size(); ++i) index_[definitions[i].name] = i;
    for (const Definition& definition : definitions) {
      std::set<size_t> needed;
      for (const SyntaxNode& node : definition.syntax.nodes) {
        if (node.operation != Operation::kVariable) continue;
        if (const auto found = index_.find(node.name); found != index_.end()) {
          needed.insert(found->second);
        }
      }
      needs_.emplace_back(needed.begin(), needed.end());
    }
  }

  // Returns false if there is no order; cycle() then returns the cycle.
  bool Find() {
    std::vector<size_t> next(needs_.size(), 0);
    std::vector<bool> done(needs_.size(), false), on_path(needs_.size(), false);
    for (size_t first = 0; first < needs_.size(); ++first) {
      if (!done[first]) path_ = {first};
      while (!path_.empty()) {
        const size_t current = path_.back();
        on_path[current] = true;
        if (next[current] == needs_[current].size()) {
          on_path[current] = false;
          done[current] = true;
          order_.push_back(current);
          path_.pop_back();
          continue;
        }
        const size_t needed = needs_[current][next[current]++];
        if (done[needed]) continue;
        path_.push_back(needed);
        if (on_path[needed]) return false;
      }
    }
    return true;
  }

  const std::vector<size_t>& order() const { return order_; }
  std::vector<size_t> cycle() const {
    return {std::find(path_.begin(), path_.end(), path_.back()), path_.end()};
  }

 private:
  std::map<std::string, size_t> index_;
  std::vector<std::vector<size_t>> needs_;
  std::vector<size_t> path_, order_;
};

// Whether the node is a constant subexpression whose value is not finite: the graph leaves such a
// node unfolded.
bool IsNotFinite(const Graph& graph, NodeId id, const NodeId (&operands)[3]) {
  if (graph.IsConstant(id)) return false;
  return std::all_of(std::begin(operands), std::end(operands),
                     [&graph](NodeId operand) { return operand < 0 || graph.IsConstant(operand); });
}

}  // namespace

absl::Status SortByDependency(std::vector<Definition>& definitions) {
  DependencyOrder dependencies(definitions);
  if (!dependencies.Find()) {
    const std::vector<size_t> cycle = dependencies.cycle();
    const std::string way = absl::StrJoin(
        cycle, " → ",
        [&definitions](std::string* text, size_t i) { text->append(definitions[i].name); });
    return InvalidField(definitions[cycle.front()].syntax.field,
                        absl::StrCat("depends on itself: ", way));
  }
  std::vector<Definition> sorted;
  for (const size_t i : dependencies.order()) sorted.push_back(std::move(definitions[i]));
  definitions = std::move(sorted);
  return absl::OkStatus();
}

absl::StatusOr<NodeId> Lower(const Syntax& syntax, const std::map<std::string, NodeId>& names,
                             const std::map<std::string, int>& tables, Graph& graph) {
  std::vector<NodeId> ids;
  for (const SyntaxNode& node : syntax.nodes) {
    NodeId operands[3] = {-1, -1, -1};
    for (int i = 0; i < 3; ++i) {
      if (node.operands[i] >= 0) operands[i] = ids[static_cast<size_t>(node.operands[i])];
    }
    NodeId id = Graph::kZero;
    switch (node.operation) {
      case Operation::kConstant:
        id = graph.Constant(node.value);
        break;
      case Operation::kVariable:
        id = names.at(node.name);
        break;
      case Operation::kLookup:
        id = graph.Look(Operation::kLookup, tables.at(node.name), operands[0], operands[1]);
        break;
      default:
        id = graph.Apply(node.operation, operands[0], operands[1], operands[2]);
        if (IsNotFinite(graph, id, operands)) {
          return ErrorAt(syntax.field, syntax.text, node.offset, "the value here is not finite");
        }
    }
    if (graph.exhausted()) {
      return FieldError(absl::StatusCode::kResourceExhausted, syntax.field,
                        absl::StrCat("too much; all expressions together may have ", kMaxNodes,
                                     " different operations at most"));
    }
    ids.push_back(id);
  }
  POLYEST_CHECK(!ids.empty());
  return ids.back();
}

}  // namespace polyest::internal::equations
