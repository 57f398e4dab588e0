#pragma once

// Writes a file first under another name, FILE.part, so that a command that fails leaves an
// existing file as it is.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>
#include <sys/stat.h>

#include <memory>
#include <string>

namespace polyest::internal {

class DraftFile {
 public:
  // Makes a new draft of the file with these permissions, less the umask. INVALID_ARGUMENT if it
  // cannot be written.
  static absl::StatusOr<std::unique_ptr<DraftFile>> Open(const std::string& file, mode_t mode);
  // Removes the draft, unless it has taken the place of the file.
  ~DraftFile();
  DraftFile(const DraftFile&) = delete;
  DraftFile& operator=(const DraftFile&) = delete;

  // Appends the bytes. INVALID_ARGUMENT if they cannot be written.
  absl::Status Write(absl::string_view bytes);
  // Replaces the file by the draft, and returns when that is on the disk. The last call.
  absl::Status Replace();

 private:
  explicit DraftFile(const std::string& file) : file_(file), draft_(file + ".part") {}
  absl::Status Failed() const;

  const std::string file_;
  const std::string draft_;
  int descriptor_ = -1;  // of the draft; negative: there is none
  size_t unsynced_ = 0;  // bytes
};

}  // namespace polyest::internal
