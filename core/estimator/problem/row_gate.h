#pragma once

// The condition under which a row's samples are used (Problem::use_when): an expression over the
// time t and columns of the data.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/common/types.h"
#include "core/model/equations/expressions.h"

namespace polyest::internal {

class RowGate {
 public:
  // Reads the expression. Returns InvalidArgument, or ResourceExhausted beyond a limit of the
  // language, that names `use_when`, the column in the text and the rule.
  static absl::StatusOr<RowGate> Make(const std::string& text);

  // The columns of the data that the expression names, in the order of its variables.
  const std::vector<std::string>& columns() const { return columns_; }

  // Returns for each row whether its samples are used. `values`: rows × columns, NaN where a column
  // has had no sample yet; such a row is not used, nor is one for which the expression is not a
  // number. `time_s`: one for each row.
  std::vector<bool> Uses(const Matrix& values, const std::vector<double>& time_s) const;

 private:
  RowGate(std::vector<std::string> columns, Expressions expression)
      : columns_(std::move(columns)), expression_(std::move(expression)) {}

  std::vector<std::string> columns_;
  Expressions expression_;  // over the columns and t
};

}  // namespace polyest::internal
