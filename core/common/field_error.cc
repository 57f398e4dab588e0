#include "core/common/field_error.h"

#include <absl/strings/cord.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <algorithm>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// The names of the status's payloads: the path, and whether the message begins with it.
constexpr char kField[] = "polyest/field";
constexpr char kShown[] = "polyest/field-shown";

// Encodes each step as its kind, the length of its text, ':' and the text, which may hold anything.
std::string Encode(const FieldPath& field) {
  std::string encoded;
  for (const FieldStep& step : field.steps()) {
    absl::StrAppend(&encoded, static_cast<int>(step.kind()), step.text().size(), ":", step.text());
  }
  return encoded;
}

FieldPath Decode(absl::string_view encoded) {
  FieldPath field;
  while (!encoded.empty()) {
    const auto kind = static_cast<FieldStep::Kind>(encoded.front() - '0');
    const size_t colon = encoded.find(':');
    size_t size = 0;
    POLYEST_CHECK(colon != absl::string_view::npos &&
                  absl::SimpleAtoi(encoded.substr(1, colon - 1), &size));
    field = field.Then({FieldStep(kind, std::string(encoded.substr(colon + 1, size)))});
    encoded.remove_prefix(colon + 1 + size);
  }
  return field;
}

// Returns the beginning of a message that shows the path.
std::string Prefix(const FieldPath& field) {
  return field.empty() ? "" : absl::StrCat(field.ToString(), ": ");
}

bool IsShown(const absl::Status& status) { return status.GetPayload(kShown).has_value(); }

// Returns a status with the same code, payloads and sentence that refuses `field`.
absl::Status WithField(const absl::Status& status, const FieldPath& field, bool shown) {
  absl::Status changed(status.code(), absl::StrCat(shown ? Prefix(field) : "", SentenceOf(status)));
  status.ForEachPayload([&changed](absl::string_view name, const absl::Cord& payload) {
    changed.SetPayload(name, payload);
  });
  changed.SetPayload(kField, absl::Cord(Encode(field)));
  if (shown) {
    changed.SetPayload(kShown, absl::Cord());
  } else {
    changed.ErasePayload(kShown);
  }
  return changed;
}

}  // namespace

FieldPath::FieldPath(absl::string_view text) {
  while (!text.empty()) {
    if (text.front() == '.') text.remove_prefix(1);
    if (!text.empty() && text.front() == '[') {
      const size_t end = std::min(text.size(), text.find(']'));
      steps_.push_back({FieldStep::Kind::kIndex, std::string(text.substr(1, end - 1))});
      text.remove_prefix(std::min(text.size(), end + 1));
      continue;
    }
    const size_t end = std::min(text.size(), text.find_first_of(".["));
    steps_.push_back({FieldStep::Kind::kName, std::string(text.substr(0, end))});
    text.remove_prefix(end);
  }
}

FieldPath FieldPath::Then(const FieldPath& inner) const {
  FieldPath longer = *this;
  longer.steps_.insert(longer.steps_.end(), inner.steps_.begin(), inner.steps_.end());
  return longer;
}

std::string FieldPath::ToString() const {
  std::string text;
  for (const FieldStep& step : steps_) {
    if (step.kind() == FieldStep::Kind::kIndex) {
      absl::StrAppend(&text, "[", step.text(), "]");
    } else {
      absl::StrAppend(&text, text.empty() ? "" : ".", step.text());
    }
  }
  return text;
}

absl::Status FieldError(absl::StatusCode code, const FieldPath& field, absl::string_view sentence) {
  POLYEST_CHECK(code != absl::StatusCode::kOk);
  return WithField(absl::Status(code, sentence), field, /*shown=*/true);
}

absl::Status InvalidField(const FieldPath& field, absl::string_view sentence) {
  return FieldError(absl::StatusCode::kInvalidArgument, field, sentence);
}

absl::Status CheckRange(const FieldPath& field, int64_t value, int64_t least, int64_t most) {
  if (value >= least && value <= most) return absl::OkStatus();
  return InvalidField(field, absl::StrCat(value, " must be from ", least, " to ", most));
}

absl::Status CheckAtLeast(const FieldPath& field, int64_t value, int64_t least) {
  if (value >= least) return absl::OkStatus();
  return InvalidField(field, absl::StrCat(value, " must be at least ", least));
}

std::string RowInWords(int64_t row) { return absl::StrCat("row ", row, " (counted from 0)"); }

absl::Status NamedInWords(const FieldPath& field, const absl::Status& status) {
  return status.ok() ? status : WithField(status, field, /*shown=*/false);
}

std::optional<FieldPath> FieldOf(const absl::Status& status) {
  const auto encoded = status.GetPayload(kField);
  if (!encoded) return std::nullopt;
  return Decode(std::string(*encoded));
}

absl::string_view SentenceOf(const absl::Status& status) {
  absl::string_view sentence = status.message();
  if (IsShown(status)) sentence.remove_prefix(Prefix(*FieldOf(status)).size());
  return sentence;
}

absl::Status Within(const FieldPath& outer, const absl::Status& status) {
  const std::optional<FieldPath> inner = FieldOf(status);
  if (!inner && !absl::IsInvalidArgument(status)) return status;
  return WithField(status, outer.Then(inner.value_or(FieldPath())), !inner || IsShown(status));
}

absl::Status RenameFields(const absl::Status& status,
                          const std::function<std::string(const std::string&)>& rename) {
  const std::optional<FieldPath> field = FieldOf(status);
  if (!field) return status;
  FieldPath renamed;
  for (const FieldStep& step : field->steps()) {
    const bool is_name = step.kind() == FieldStep::Kind::kName;
    renamed = renamed.Then({is_name ? FieldStep(rename(step.text())) : step});
  }
  return WithField(status, renamed, IsShown(status));
}

}  // namespace polyest::internal
