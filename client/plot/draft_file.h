#pragma once

// Writes a file first under another name in its folder, FILE.part, so that a command that fails, or
// that a signal ends, leaves an existing file as it is. All files that commands write are written
// so.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>
#include <sys/stat.h>

#include <memory>
#include <optional>
#include <string>

#include "client/plot/removed_at_signal.h"

namespace polyest::internal {

// What a name stands for decides how it is written: a symbolic link's target, if that is a file or
// nothing yet, takes the draft in place of the link. A device or a pipe is written at once, and so
// is a file whose folder takes no new file. A FILE.part that is there already stays.
class DraftFile {
 public:
  // Returns OK if the file may be written to, or if its folder is there and may take it; changes
  // nothing. Otherwise INVALID_ARGUMENT with the file and the reason.
  static absl::Status Check(const std::string& file);
  // Makes a new draft of the file with these permissions, less the umask and less what an existing
  // file does not permit. Fails as Check.
  static absl::StatusOr<std::unique_ptr<DraftFile>> Open(const std::string& file, mode_t mode);
  // Removes the draft, unless it has taken the place of the file.
  ~DraftFile();
  DraftFile(const DraftFile&) = delete;
  DraftFile& operator=(const DraftFile&) = delete;

  // Appends the bytes. Fails as Check.
  absl::Status Write(absl::string_view bytes);
  // Replaces the file by the draft, and returns when that is on the disk. The last call.
  absl::Status Replace();

 private:
  explicit DraftFile(const std::string& file);
  bool OpenDraft(mode_t mode);
  absl::Status Failed() const;

  const std::string name_;    // as the user writes it
  const std::string target_;  // what it stands for
  std::string draft_;         // empty: the target is written at once
  std::optional<RemovedAtSignal> removed_at_signal_;
  int descriptor_ = -1;  // of the draft, or of the target; negative: there is none
  size_t unsynced_ = 0;  // bytes
};

}  // namespace polyest::internal
