#include "proto/wire/convert/problem_columns.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <map>
#include <string>

#include "core/common/field_error.h"
#include "core/model/equations/parser.h"
#include "core/model/unit_conversion.h"

namespace polyest::internal {
namespace {

// Returns the quantities that a data file may have.
std::vector<std::string> Recorded(const v1::Problem& problem) {
  std::vector<std::string> names = {"t", "run"};
  for (const v1::MeasuredOutput& measured : problem.measured()) names.push_back(measured.output());
  for (const v1::Input& input : problem.inputs()) {
    if (input.has_streamed()) names.push_back(input.name());
  }
  const auto syntax = equations::Parse(FieldPath("use_when"), problem.use_when(), {});
  if (!problem.use_when().empty() && syntax.ok()) {
    const std::vector<std::string> conditions = equations::VariablesIn(*syntax);
    names.insert(names.end(), conditions.begin(), conditions.end());
  }
  return names;
}

// Returns the unit of a recorded quantity; empty if it is not known.
std::string RecordedUnit(const std::string& quantity, const Model* model) {
  if (quantity == "t") return "s";
  if (model == nullptr) return "";
  const ModelDescription& description = model->description();
  if (const auto output = description.FindOutput(quantity)) {
    return description.outputs[static_cast<size_t>(*output)].unit;
  }
  const auto input = description.FindInput(quantity);
  return input ? description.inputs[static_cast<size_t>(*input)].unit : "";
}

absl::Status CheckColumn(const std::string& quantity, const v1::Problem::Column& column,
                         const std::vector<std::string>& known, const Model* model) {
  const FieldPath field = FieldPath{"columns"}.Then({FieldStep::Key(quantity)});
  if (std::find(known.begin(), known.end(), quantity) == known.end()) {
    return InvalidField(
        field,
        absl::StrCat("is neither a measured output nor a streamed input nor named by useWhen; ",
                     "known names: ", absl::StrJoin(known, ", ")));
  }
  if (column.from().empty() && column.unit().empty()) {
    return InvalidField(field, "from or unit must be given, as in {\"from\": \"Disp [mm]\"}");
  }
  if (column.unit().empty()) return absl::OkStatus();
  if (quantity == "run") return InvalidField(field.Then("unit"), "run has no unit");
  const std::string unit = RecordedUnit(quantity, model);
  return Within(field.Then("unit"), unit.empty() ? CheckRecordedUnit(column.unit())
                                                 : ConvertUnit(column.unit(), unit).status());
}

}  // namespace

std::vector<absl::Status> CheckColumns(const v1::Problem& problem, const Model* model) {
  const std::vector<std::string> known = Recorded(problem);
  // A protobuf map has no order; std::map gives the errors one.
  const std::map<std::string, v1::Problem::Column> columns(problem.columns().begin(),
                                                           problem.columns().end());
  std::vector<absl::Status> refusals;
  for (const auto& [quantity, column] : columns) {
    absl::Status checked = CheckColumn(quantity, column, known, model);
    if (!checked.ok()) refusals.push_back(std::move(checked));
  }
  return refusals;
}

}  // namespace polyest::internal
