#include "client/cli/input_files.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <optional>

#include "client/cli/refused_row.h"
#include "core/common/field_error.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {
namespace {

bool IsFieldOfProblem(const FieldStep& step) {
  const google::protobuf::Descriptor& problem = *v1::Problem::descriptor();
  for (int i = 0; i < problem.field_count(); ++i) {
    if (problem.field(i)->json_name() == step.text()) return true;
  }
  return false;
}

absl::Status InData(const absl::Status& status, const DataInFile& data) {
  const std::optional<int> row = RefusedRow(status);
  const int64_t line = row ? data.lines.LineOf(*row) : 0;
  if (line == 0) return absl::InvalidArgumentError(absl::StrCat(data.file, ": ", status.message()));
  absl::string_view sentence = SentenceOf(status);
  if (absl::ConsumePrefix(&sentence, RowInWords(*row)) && !absl::ConsumePrefix(&sentence, ", ")) {
    absl::ConsumePrefix(&sentence, ": ");
  }
  return absl::InvalidArgumentError(absl::StrCat(data.file, ":", line, ": ", sentence));
}

}  // namespace

absl::Status InFiles(const absl::Status& status, const InputFiles& files) {
  const std::optional<FieldPath> field = FieldOf(status);
  if (!absl::IsInvalidArgument(status) || !field || field->empty()) return status;
  const FieldStep& first = field->steps().front();
  for (const auto& [name, data] :
       {std::pair{"measurements", &files.data}, {"record", &files.record}}) {
    if (first == FieldStep(name)) return data->file.empty() ? status : InData(status, *data);
  }
  if (files.problem.empty() || !IsFieldOfProblem(first)) return status;
  return absl::InvalidArgumentError(absl::StrCat(files.problem, ": ", status.message()));
}

}  // namespace polyest::internal
