#include "polyest/problem_file.h"

#include <absl/status/status.h>
#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/strip.h>
#include <google/protobuf/util/json_util.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

#include "client/cpp/file_kind.h"
#include "core/common/status.h"
#include "proto/wire/json/json_error.h"
#include "proto/wire/json/json_structure.h"
#include "proto/wire/json/missing_bounds.h"
#include "proto/wire/json/unknown_fields.h"
#include "proto/wire/json/wrong_values.h"
#include "proto/wire/transport/automatic_order.h"

namespace polyest {

using namespace internal;
using google::protobuf::Descriptor;

namespace {

constexpr size_t kMaxFileBytes = size_t{16} << 20;

absl::Status InFile(absl::string_view name, const JsonError& error) {
  return absl::InvalidArgumentError(
      absl::StrCat(name, ":", error.line, ":", error.column, ": ", error.Sentence()));
}

// Returns an error that names all unknown fields in one line.
absl::Status UnknownFieldsError(absl::string_view name, const std::vector<UnknownField>& fields) {
  const auto note = [](const UnknownField& field, const char* before, const char* after) {
    return field.suggestion.empty() ? "" : absl::StrCat(before, field.suggestion, after);
  };
  if (fields.size() == 1) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": ", fields[0].path, ": unknown field", note(fields[0], "; ", "")));
  }
  const auto append = [&](std::string* out, const UnknownField& field) {
    absl::StrAppend(out, field.path, note(field, " (", ")"));
  };
  return absl::InvalidArgumentError(absl::StrCat(
      name, ": ", fields.size(), " unknown fields: ", absl::StrJoin(fields, ", ", append)));
}

}  // namespace

absl::StatusOr<v1::Problem> ParseProblem(absl::string_view json, absl::string_view name) {
  // Some editors write the mark of UTF-8, which protobuf's parser does not know.
  absl::ConsumePrefix(&json, "\xEF\xBB\xBF");
  if (absl::StripAsciiWhitespace(json).empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": is empty; it must hold one JSON object, the problem"));
  }
  const Descriptor& type = *v1::Problem::descriptor();
  if (const auto error = CheckJsonStructure(json, type)) {
    if (KindOfText(json) != FileKind::kCsv) return InFile(name, *error);
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": is CSV data; a problem is one JSON object"));
  }
  v1::Problem problem;
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = false;
  const auto status =
      google::protobuf::util::JsonStringToMessage(WithoutAutomaticOrder(json), &problem, options);
  std::string wrong = FindWrongValue(json, type);
  if (status.ok() && wrong.empty()) wrong = FindMissingBound(json, problem);
  if (status.ok() && wrong.empty()) return problem;
  const auto unknown = FindUnknownFields(json, type);
  if (!unknown.empty()) return UnknownFieldsError(name, unknown);
  if (!wrong.empty()) return absl::InvalidArgumentError(absl::StrCat(name, ": ", wrong));
  return absl::InvalidArgumentError(absl::StrCat(
      name, ": ", DescribeParserMessage({status.message().data(), status.message().size()})));
}

absl::StatusOr<v1::Problem> ReadProblemFile(const std::string& path) {
  POLYEST_RETURN_IF_ERROR(CheckIsNoFolder(path));
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": cannot be opened: ", std::strerror(errno)));
  }
  std::string json;
  std::array<char, 4096> block;
  while (in.read(block.data(), block.size()), in.gcount() > 0) {
    json.append(block.data(), static_cast<size_t>(in.gcount()));
    if (json.size() > kMaxFileBytes) {
      return absl::InvalidArgumentError(absl::StrCat(path, ": is longer than 16 MiB"));
    }
  }
  if (in.bad()) return absl::InvalidArgumentError(absl::StrCat(path, ": cannot be read"));
  return ParseProblem(json, path);
}

}  // namespace polyest
