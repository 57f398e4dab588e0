#include "client/cpp/file_kind.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <filesystem>
#include <fstream>

namespace polyest::internal {
namespace {

// Number of bytes of a file that are examined.
constexpr std::streamsize kMaxBeginning = 4096;

}  // namespace

FileKind KindOfText(absl::string_view text) {
  absl::ConsumePrefix(&text, "\xEF\xBB\xBF");
  text = absl::StripLeadingAsciiWhitespace(text);
  if (text.empty()) return FileKind::kUnknown;
  if (text.front() == '{' || text.front() == '[') return FileKind::kJson;
  const absl::string_view line = absl::StripAsciiWhitespace(text.substr(0, text.find('\n')));
  const bool has_cells = line.find_first_of(",;\t") != absl::string_view::npos;
  return has_cells || line == "t" ? FileKind::kCsv : FileKind::kUnknown;
}

FileKind KindOfFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text(kMaxBeginning, '\0');
  in.read(text.data(), kMaxBeginning);
  text.resize(static_cast<size_t>(in.gcount()));
  return KindOfText(text);
}

absl::Status CheckIsNoFolder(const std::string& path) {
  std::error_code unknown;
  if (!std::filesystem::is_directory(path, unknown)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(path, ": is a folder, not a file"));
}

}  // namespace polyest::internal
