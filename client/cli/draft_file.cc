#include "client/cli/draft_file.h"

#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

namespace polyest::internal {
namespace {

constexpr size_t kSyncedAtOnce = 4 << 20;

// Brings the names in the folder of a file to the disk, if the user may read the folder and its
// file system can do that. Returns false on an error of the disk.
bool SyncFolderOf(const std::string& file) {
  // The point is the folder itself, also for a file without one.
  const std::filesystem::path folder = std::filesystem::path(file).parent_path() / ".";
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return errno == EACCES;
  const bool synced = fsync(descriptor) == 0 || errno == EINVAL;
  close(descriptor);
  return synced;
}

}  // namespace

absl::StatusOr<std::unique_ptr<DraftFile>> DraftFile::Open(const std::string& file, mode_t mode) {
  std::unique_ptr<DraftFile> draft(new DraftFile(file));
  const char* const path = draft->draft_.c_str();
  std::remove(path);
  draft->descriptor_ = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (draft->descriptor_ < 0) return draft->Failed();
  return draft;
}

DraftFile::~DraftFile() {
  if (descriptor_ < 0) return;
  close(descriptor_);
  std::remove(draft_.c_str());
}

absl::Status DraftFile::Write(absl::string_view bytes) {
  unsynced_ += bytes.size();
  while (!bytes.empty()) {
    const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return Failed();
    bytes.remove_prefix(static_cast<size_t>(written));
  }
  // The daemon may have its sessions on the same disk: its commits wait for little at a time.
  if (unsynced_ < kSyncedAtOnce) return absl::OkStatus();
  unsynced_ = 0;
  return fdatasync(descriptor_) == 0 ? absl::OkStatus() : Failed();
}

absl::Status DraftFile::Replace() {
  if (fsync(descriptor_) != 0 || std::rename(draft_.c_str(), file_.c_str()) != 0) return Failed();
  close(std::exchange(descriptor_, -1));
  return SyncFolderOf(file_) ? absl::OkStatus() : Failed();
}

absl::Status DraftFile::Failed() const {
  return absl::InvalidArgumentError(
      absl::StrFormat("%s: cannot be written: %s", draft_, std::strerror(errno)));
}

}  // namespace polyest::internal
