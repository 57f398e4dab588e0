#include "client/cli/refused_row.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <vector>

#include "core/common/field_error.h"

namespace polyest::internal {
namespace {

bool HasRecord(const FieldStep& field) {
  return field == FieldStep("measurements") || field == FieldStep("record");
}

bool HasRows(const FieldStep& field) {
  return field == FieldStep("timeS") || field == FieldStep("run") || field == FieldStep("values");
}

}  // namespace

std::optional<int> RefusedRow(const absl::Status& status) {
  const std::optional<FieldPath> field = FieldOf(status);
  if (!absl::IsInvalidArgument(status) || !field) return std::nullopt;
  const std::vector<FieldStep>& steps = field->steps();
  int row = 0;
  const bool found =
      steps.size() >= 3 && HasRecord(steps.front()) && HasRows(steps[steps.size() - 2]) &&
      steps.back().kind() == FieldStep::Kind::kIndex && absl::SimpleAtoi(steps.back().text(), &row);
  return found ? std::optional<int>(row) : std::nullopt;
}

absl::Status AtRowOfData(const absl::Status& status, int64_t rows_before) {
  const std::optional<int> row = RefusedRow(status);
  if (!row) return status;
  FieldPath field;
  const std::vector<FieldStep> steps = FieldOf(status)->steps();
  for (size_t i = 0; i + 1 < steps.size(); ++i) field = field.Then({steps[i]});
  field = field.Then({rows_before + *row});
  absl::string_view sentence = SentenceOf(status);
  if (!absl::ConsumePrefix(&sentence, RowInWords(*row))) {
    return InvalidField(field, sentence);
  }
  return NamedInWords(
      field, absl::InvalidArgumentError(absl::StrCat(RowInWords(rows_before + *row), sentence)));
}

}  // namespace polyest::internal
