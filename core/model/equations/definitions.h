#pragma once

// Named expressions that refer to one another, made into nodes of a graph.

#include <absl/status/statusor.h>

#include <map>
#include <string>
#include <vector>

#include "core/model/equations/graph.h"
#include "core/model/equations/parser.h"

namespace polyest::internal::equations {

struct Definition {
  std::string name;
  Syntax syntax;
};

// Puts each definition after those that it refers to. One that depends on itself is an
// INVALID_ARGUMENT that shows the way round.
absl::Status SortByDependency(std::vector<Definition>& definitions);

// The node of the expression. `names` has every name in it and `tables` the index of every table.
// A constant part without a finite value is INVALID_ARGUMENT with its column, more nodes than the
// graph may have RESOURCE_EXHAUSTED.
absl::StatusOr<NodeId> Lower(const Syntax& syntax, const std::map<std::string, NodeId>& names,
                             const std::map<std::string, int>& tables, Graph& graph);

}  // namespace polyest::internal::equations
