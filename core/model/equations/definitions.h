#pragma once

// Named expressions that refer to one another, and their translation into nodes of a graph.

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

// Sorts the definitions so that each follows those it refers to. Returns InvalidArgument, with the
// cycle in the message, if one depends on itself.
absl::Status SortByDependency(std::vector<Definition>& definitions);

// Adds the expression to `graph` and returns its node. `names` must hold the node of every name in
// it, and `tables` the index of every table. Returns InvalidArgument with the column for a constant
// subexpression whose value is not finite, and ResourceExhausted if the graph would exceed its
// maximum number of nodes.
absl::StatusOr<NodeId> Lower(const Syntax& syntax, const std::map<std::string, NodeId>& names,
                             const std::map<std::string, int>& tables, Graph& graph);

}  // namespace polyest::internal::equations
