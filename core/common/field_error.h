#pragma once

// Refusals of a field that say which one as data, so that nobody has to read it out of a sentence.
//
// Such a status has the field's path as a payload, and the message "path: sentence". Whoever passes
// it on from an inner structure to an outer one puts the outer place in front with Within(), which
// changes the path and the message together:
//
//   POLYEST_RETURN_IF_ERROR(Within({"measured", 0}, Validate(noise)));
//   // noise.absolute: -1 must be …  →  measured[0].noise.absolute: -1 must be …

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <concepts>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace polyest::internal {

// One step of the way to a field: into a field of a structure, an element of a list, or the value
// of a key in a map.
class FieldStep {
 public:
  enum class Kind { kName, kIndex, kKey };

  FieldStep(const char* name) : FieldStep(Kind::kName, name) {}
  FieldStep(std::string name) : FieldStep(Kind::kName, std::move(name)) {}
  FieldStep(std::integral auto index) : FieldStep(Kind::kIndex, std::to_string(index)) {}
  FieldStep(Kind kind, std::string text) : kind_(kind), text_(std::move(text)) {}
  // A key is what a user wrote, and may be any text.
  static FieldStep Key(absl::string_view key) { return {Kind::kKey, std::string(key)}; }

  Kind kind() const { return kind_; }
  // The name, the index in digits, or the key.
  const std::string& text() const { return text_; }
  bool operator==(const FieldStep&) const = default;

 private:
  Kind kind_;
  std::string text_;
};

// The way to a field, from the structure that whoever reads it has at hand. Empty: that structure
// itself.
class FieldPath {
 public:
  FieldPath() = default;
  FieldPath(std::initializer_list<FieldStep> steps) : steps_(steps) {}
  // A path that a program has written, "measured[0].noise": names and indices, no keys.
  FieldPath(absl::string_view text);
  FieldPath(const std::string& text) : FieldPath(absl::string_view(text)) {}
  FieldPath(const char* text) : FieldPath(absl::string_view(text)) {}

  const std::vector<FieldStep>& steps() const { return steps_; }
  bool empty() const { return steps_.empty(); }
  // The path with another one after it.
  FieldPath Then(const FieldPath& inner) const;
  // "measured[0].noise.absolute"; keys stand like names.
  std::string ToString() const;
  bool operator==(const FieldPath&) const = default;

 private:
  std::vector<FieldStep> steps_;
};

// Returns the refusal of a field with the message "path: sentence".
absl::Status FieldError(absl::StatusCode code, const FieldPath& field, absl::string_view sentence);
// The same as INVALID_ARGUMENT.
absl::Status InvalidField(const FieldPath& field, absl::string_view sentence);
// Returns the refusal of a field whose sentence names the place in words of its own ("row 3, column
// x: …"): the path is data only.
absl::Status NamedInWords(const FieldPath& field, const absl::Status& status);

// Returns the field that a status refuses; nothing when it has none.
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
