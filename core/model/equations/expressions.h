#pragma once

// Named expressions over named variables in the language of equation models (README.md), for
// parameters that are tied to others: {"k2": "k1", "I": "m*r^2"}.

#include <absl/status/statusor.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/common/field_error.h"
#include "core/common/types.h"
#include "core/model/equations/program.h"

namespace polyest::internal {

class Expressions {
 public:
  // definitions: name -> text, which may use the variables and other definitions, without a cycle;
  // no time and no tables. `field` begins each message: "derived" gives "derived.k2: column 3: …".
  // INVALID_ARGUMENT, or RESOURCE_EXHAUSTED past a limit.
  static absl::StatusOr<Expressions> Make(const FieldPath& field,
                                          const std::map<std::string, std::string>& definitions,
                                          const std::vector<std::string>& variables);

  const std::vector<std::string>& names() const { return names_; }  // in the map's order
  // Those of the variables that some definition refers to.
  const std::set<std::string>& variables_used() const { return variables_used_; }

  // variables: rows × variables, results: rows × names; any number of rows. A result need not be
  // finite.
  void Evaluate(const ConstMatrixRef& variables, MatrixRef results) const;

 private:
  Expressions() = default;

  std::vector<std::string> names_;
  std::set<std::string> variables_used_;
  Eigen::Index variables_ = 0;
  equations::Program program_;
};

}  // namespace polyest::internal
