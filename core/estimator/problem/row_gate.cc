#include "core/estimator/problem/row_gate.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/common/status.h"
#include "core/model/equations/parser.h"

namespace polyest::internal {

absl::StatusOr<RowGate> RowGate::Make(const std::string& text) {
  POLYEST_ASSIGN_OR_RETURN(const equations::Syntax syntax,
                           equations::Parse(FieldPath("use_when"), text, {}));
  std::vector<std::string> columns = equations::VariablesIn(syntax);
  std::erase(columns, "t");
  std::vector<std::string> variables = columns;
  variables.push_back("t");
  std::string definition = "used";
  while (std::find(columns.begin(), columns.end(), definition) != columns.end()) definition += '_';
  POLYEST_ASSIGN_OR_RETURN(Expressions expression,
                           Expressions::Make("use_when", {{definition, text}}, variables));
  return RowGate(std::move(columns), std::move(expression));
}

std::vector<bool> RowGate::Uses(const Matrix& values, const std::vector<double>& time_s) const {
  const auto rows = std::ssize(time_s);
  std::vector<bool> used(time_s.size(), false);
  if (rows == 0) return used;
  Matrix variables(rows, values.cols() + 1);
  variables.leftCols(values.cols()) = values;
  variables.col(values.cols()) = Eigen::Map<const Vector>(time_s.data(), rows);
  Matrix results(rows, 1);
  expression_.Evaluate(variables, results);
  for (Eigen::Index k = 0; k < rows; ++k) {
    used[static_cast<size_t>(k)] =
        !values.row(k).hasNaN() && !std::isnan(results(k, 0)) && results(k, 0) != 0;
  }
  return used;
}

}  // namespace polyest::internal
