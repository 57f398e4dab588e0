#include "client/plot/output_file.h"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace polyest::internal {
namespace {

absl::Status CannotWrite(absl::string_view option, const std::string& file, int error) {
  return absl::UnknownError(
      absl::StrCat(option, ": cannot write ", file, ": ", std::strerror(error)));
}

}  // namespace

absl::Status CheckOutputFile(absl::string_view option, const std::string& file) {
  const std::filesystem::path path(file);
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown)) return CannotWrite(option, file, EISDIR);
  if (std::filesystem::exists(path, unknown)) {
    return access(file.c_str(), W_OK) == 0 ? absl::OkStatus() : CannotWrite(option, file, errno);
  }
  // The point is an entry of folders only.
  const std::filesystem::path folder = path.parent_path() / ".";
  if (access(folder.c_str(), W_OK | X_OK) == 0) return absl::OkStatus();
  return CannotWrite(option, file, errno);
}

absl::Status WriteOutputFile(absl::string_view option, const std::string& file,
                             absl::string_view text) {
  errno = 0;
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << text;
  stream.close();
  return stream ? absl::OkStatus() : CannotWrite(option, file, errno);
}

}  // namespace polyest::internal
