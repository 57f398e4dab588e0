#pragma once

// Named expressions over named variables in the language of equation models (README.md). They
// define parameters that depend on others: {"k2": "k1", "I": "m*r^2"}.

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
  // Reads `definitions`, a map from name to text. A text may use the variables and other
  // definitions without a cycle, but neither time nor tables. Every error message starts with
  // `field`: "derived" gives "derived.k2: column 3: …". Returns InvalidArgument for an invalid
  // definition, or ResourceExhausted beyond a limit of limits.h.
  static absl::StatusOr<Expressions> Make(const FieldPath& field,
                                          const std::map<std::string, std::string>& definitions,
                                          const std::vector<std::string>& variables);

  // Returns the names in the map's order, which is the order of the columns that Evaluate fills.
  const std::vector<std::string>& names() const { return names_; }
  // Returns the variables that at least one definition refers to.
  const std::set<std::string>& variables_used() const { return variables_used_; }

  // Evaluates the expressions for each row. `variables` has the shape rows × variables and
  // `results` rows × names, with any number of rows. A result may be infinite or NaN.
  void Evaluate(const ConstMatrixRef& variables, MatrixRef results) const;

 private:
  Expressions() = default;

  std::vector<std::string> names_;
  std::set<std::string> variables_used_;
  Eigen::Index variables_ = 0;
  equations::Program program_;
};

}  // namespace polyest::internal
