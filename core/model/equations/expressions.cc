#include "core/model/equations/expressions.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <array>
#include <utility>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/model/equations/definitions.h"
#include "core/model/equations/functions.h"
#include "core/model/equations/limits.h"
#include "core/model/equations/text_error.h"

namespace polyest::internal {
namespace equations {
namespace {

constexpr size_t kMaxListed = 50;  // names in a message

absl::Status CheckSizes(const FieldPath& field,
                        const std::map<std::string, std::string>& definitions) {
  size_t text = 0;
  for (const auto& [name, expression] : definitions) text += expression.size();
  if (definitions.size() <= kMaxExpressions && text <= kMaxTextInAll) return absl::OkStatus();
  return FieldError(absl::StatusCode::kResourceExhausted, field,
                    absl::StrFormat("has %d expressions of %d bytes in all; at most %d of %d",
                                    definitions.size(), text, kMaxExpressions, kMaxTextInAll));
}

absl::Status CheckName(const FieldPath& field, const std::string& name,
                       const std::set<std::string>& variables) {
  const std::vector<std::string> parts = absl::StrSplit(name, '.');
  if (!std::all_of(parts.begin(), parts.end(), IsName)) {
    return InvalidField(field, absl::StrCat(Quoted(name), " is not a name"));
  }
  if (IsReserved(name) || variables.contains(name)) {
    return InvalidField(
        field.Then({FieldStep::Key(name)}),
        absl::StrCat(name, variables.contains(name) ? " is a variable already"
                                                    : " is reserved in expressions"));
  }
  return absl::OkStatus();
}

// Refuses an unknown name in the expression with InvalidArgument, and adds the variables in it to
// `used`.
absl::Status CheckNames(const Syntax& syntax, const std::set<std::string>& variables,
                        const std::map<std::string, std::string>& definitions,
                        std::set<std::string>& used) {
  for (const SyntaxNode& node : syntax.nodes) {
    if (node.operation != Operation::kVariable || definitions.contains(node.name)) continue;
    if (!variables.contains(node.name)) {
      std::vector<std::string> known(variables.begin(), variables.end());
      if (known.size() > kMaxListed) known.resize(kMaxListed);
      return ErrorAt(syntax.field, syntax.text, node.offset,
                     absl::StrFormat("unknown name %s; the names are %s", Quoted(node.name),
                                     known.empty() ? "none" : absl::StrJoin(known, ", ")));
    }
    used.insert(node.name);
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace equations

absl::StatusOr<Expressions> Expressions::Make(const FieldPath& field,
                                              const std::map<std::string, std::string>& definitions,
                                              const std::vector<std::string>& variables) {
  using namespace equations;
  POLYEST_RETURN_IF_ERROR(CheckSizes(field, definitions));
  const std::set<std::string> known(variables.begin(), variables.end());
  Expressions expressions;
  std::vector<Definition> read;
  for (const auto& [name, text] : definitions) {
    POLYEST_RETURN_IF_ERROR(CheckName(field, name, known));
    POLYEST_ASSIGN_OR_RETURN(Syntax syntax, Parse(field.Then({FieldStep::Key(name)}), text, {}));
    POLYEST_RETURN_IF_ERROR(CheckNames(syntax, known, definitions, expressions.variables_used_));
    expressions.names_.push_back(name);
    read.push_back({name, std::move(syntax)});
  }
  POLYEST_RETURN_IF_ERROR(SortByDependency(read));

  Graph graph(kMaxNodes);
  std::map<std::string, NodeId> nodes;
  std::vector<VariablePlace> places;
  for (const std::string& name : expressions.variables_used_) {
    const auto at = std::find(variables.begin(), variables.end(), name);
    nodes[name] = graph.Variable(static_cast<int>(places.size()));
    places.push_back({0, at - variables.begin()});
  }
  for (const Definition& definition : read) {
    POLYEST_ASSIGN_OR_RETURN(nodes[definition.name], Lower(definition.syntax, nodes, {}, graph));
  }
  std::vector<NodeId> roots;
  for (const std::string& name : expressions.names_) roots.push_back(nodes.at(name));
  expressions.program_ = Program(graph, roots, places, {});
  if (expressions.program_.registers() > kMaxRegisters) {
    return FieldError(absl::StatusCode::kResourceExhausted, field,
                      "needs too many intermediate values at once");
  }
  expressions.variables_ = std::ssize(variables);
  return expressions;
}

void Expressions::Evaluate(const ConstMatrixRef& variables, MatrixRef results) const {
  const Eigen::Index rows = variables.rows();
  POLYEST_CHECK(variables.cols() == variables_ && results.rows() == rows);
  POLYEST_CHECK(results.cols() == std::ssize(names_));
  // Copies of the last row pad the block to a multiple of kLanes.
  const Eigen::Index padded = (rows + kLanes - 1) / kLanes * kLanes;
  Eigen::ArrayXXd values(padded, variables.cols());
  values.topRows(rows) = variables.array();
  for (Eigen::Index row = rows; row < padded; ++row) values.row(row) = values.row(rows - 1);
  Eigen::ArrayXXd computed(padded, results.cols());
  const ConstBlock block(values);
  const std::array<const ConstBlock*, 1> blocks = {&block};
  program_.Run(0, blocks, computed);
  results = computed.topRows(rows).matrix();
}

}  // namespace polyest::internal
