#include "client/cpp/field_names.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <vector>

#include "polyest/v1/problem.pb.h"

namespace polyest {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

const FieldDescriptor* FindField(const Descriptor& message, absl::string_view name) {
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    if (field.json_name() == name || field.name() == name) return &field;
  }
  return nullptr;
}

// Letters to insert, delete, change or swap with their neighbour to make one word of the other.
size_t Distance(absl::string_view a, absl::string_view b) {
  std::vector<std::vector<size_t>> distance(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) {
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        distance[i][j] = i + j;
        continue;
      }
      const size_t change = a[i - 1] == b[j - 1] ? 0 : 1;
      distance[i][j] = std::min(
          {distance[i - 1][j] + 1, distance[i][j - 1] + 1, distance[i - 1][j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        distance[i][j] = std::min(distance[i][j], distance[i - 2][j - 2] + 1);
      }
    }
  }
  return distance[a.size()][b.size()];
}

}  // namespace

std::string SuggestFieldName(absl::string_view path) {
  constexpr size_t kLongestName = 64;
  const std::vector<absl::string_view> names = absl::StrSplit(path, '.');
  const Descriptor* message = v1::Problem::descriptor();
  for (size_t i = 0; i + 1 < names.size(); ++i) {
    const FieldDescriptor* const field =
        FindField(*message, names[i].substr(0, names[i].find('[')));
    if (field == nullptr || field->message_type() == nullptr) return "";
    message = field->message_type();
  }
  const absl::string_view wrong = names.back().substr(0, kLongestName);
  std::vector<std::string> known;
  size_t nearest = 0;
  for (int i = 0; i < message->field_count(); ++i) {
    known.push_back(message->field(i)->json_name());
    if (Distance(wrong, known.back()) < Distance(wrong, known[nearest])) nearest = known.size() - 1;
  }
  if (known.empty()) return "";
  // A third of the letters wrong is a slip; more is another word.
  if (3 * Distance(wrong, known[nearest]) <= known[nearest].size()) {
    return absl::StrCat("did you mean \"", known[nearest], "\"?");
  }
  return absl::StrCat("there are ", absl::StrJoin(known, ", "));
}

}  // namespace polyest
