#pragma once

// Errors that refuse a field and name it as data, so that no program needs to parse a sentence.
//
// The status has the field's path as a payload, and the message "path: sentence". Code that passes
// the status from an inner structure to an outer one prepends the outer field with Within(), which
// changes the path and the message together:
//
//   POLYEST_RETURN_IF_ERROR(Within({"measured", 0}, Validate(noise)));
//   // noise.absolute: -1 must be …  →  measured[0].noise.absolute: -1 must be …

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <concepts>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace polyest::internal {

// One step of a path: into a field of a structure, an element of a list, or the value of a key in a
// map.
class FieldStep {
 public:
  enum class Kind { kName, kIndex, kKey };

  FieldStep(const char* name) : FieldStep(Kind::kName, name) {}
  FieldStep(std::string name) : FieldStep(Kind::kName, std::move(name)) {}
  FieldStep(std::integral auto index) : FieldStep(Kind::kIndex, std::to_string(index)) {}
  FieldStep(Kind kind, std::string text) : kind_(kind), text_(std::move(text)) {}
  // Makes a step to a key, which a user wrote and which may be any text.
  static FieldStep Key(absl::string_view key) { return {Kind::kKey, std::string(key)}; }

  Kind kind() const { return kind_; }
  // Returns the name, the index in digits, or the key.
  const std::string& text() const { return text_; }
  bool operator==(const FieldStep&) const = default;

 private:
  Kind kind_;
  std::string text_;
};

// The path to a field, from the structure that the reader has at hand. An empty path is that
// structure itself.
class FieldPath {
 public:
  FieldPath() = default;
  FieldPath(std::initializer_list<FieldStep> steps) : steps_(steps) {}
  // Parses a path written in a program, "measured[0].noise": names and indices, no keys.
  FieldPath(absl::string_view text);
  FieldPath(const std::string& text) : FieldPath(absl::string_view(text)) {}
  FieldPath(const char* text) : FieldPath(absl::string_view(text)) {}

  const std::vector<FieldStep>& steps() const { return steps_; }
  bool empty() const { return steps_.empty(); }
  // Returns this path followed by `inner`.
  FieldPath Then(const FieldPath& inner) const;
  // Returns the path as text, "measured[0].noise.absolute"; keys are written like names.
  std::string ToString() const;
  bool operator==(const FieldPath&) const = default;

 private:
  std::vector<FieldStep> steps_;
};

// Returns a status that refuses a field with the message "path: sentence".
absl::Status FieldError(absl::StatusCode code, const FieldPath& field, absl::string_view sentence);
// Returns a FieldError with the code INVALID_ARGUMENT.
absl::Status InvalidField(const FieldPath& field, absl::string_view sentence);
// Returns OK for an integer from `least` to `most`, or an InvalidField that says so.
absl::Status CheckRange(const FieldPath& field, int64_t value, int64_t least, int64_t most);
// Returns OK for an integer from `least` on, or an InvalidField that says so.
absl::Status CheckAtLeast(const FieldPath& field, int64_t value, int64_t least);
// Returns a status that refuses a field whose sentence already names the place ("row 3 (counted
// from 0), column x: …"): the path is in the payload only.
absl::Status NamedInWords(const FieldPath& field, const absl::Status& status);
// Returns how such a sentence begins that is about a row: "row 3 (counted from 0)". Whoever knows
// the row's place in a file puts that in its stead.
std::string RowInWords(int64_t row);

// Returns the field that a status refuses; nothing if it names none.
std::optional<FieldPath> FieldOf(const absl::Status& status);
// Returns the message without the path in front.
absl::string_view SentenceOf(const absl::Status& status);

// Returns the status with `outer` in front of its path, and the same code and other payloads. An
// INVALID_ARGUMENT without a path gets `outer`; any other status without one stays as it is.
absl::Status Within(const FieldPath& outer, const absl::Status& status);
template <typename Value>
absl::StatusOr<Value> Within(const FieldPath& outer, absl::StatusOr<Value> value) {
  if (value.ok()) return value;
  return Within(outer, value.status());
}

// Returns the status with each name in its path replaced by what `rename` makes of it; indices and
// keys stay.
absl::Status RenameFields(const absl::Status& status,
                          const std::function<std::string(const std::string&)>& rename);

}  // namespace polyest::internal
