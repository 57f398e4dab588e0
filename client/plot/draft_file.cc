#include "client/plot/draft_file.h"

#include <absl/strings/str_cat.h>
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
constexpr int kMaxLinks = 40;    // as Linux
constexpr int kMaxDrafts = 100;  // of one file, such as killed programs leave

// Returns the file that a name stands for: what symbolic links lead to, also where there is nothing
// yet. The name itself for devices and pipes, since the links of /dev/stdout lead to no name.
std::string TargetOf(const std::string& name) {
  struct stat there;
  const bool exists = stat(name.c_str(), &there) == 0;
  if (exists && !S_ISREG(there.st_mode)) return name;
  std::error_code error;
  if (exists) {
    const auto target = std::filesystem::canonical(name, error);
    return error ? name : target.string();
  }
  std::filesystem::path target = name;
  for (int i = 0; i < kMaxLinks && std::filesystem::is_symlink(target, error); ++i) {
    target = target.parent_path() / std::filesystem::read_symlink(target, error);
  }
  return target;
}

// The point is the folder itself, also for a file without one; it is an entry of folders only.
std::filesystem::path FolderOf(const std::string& file) {
  return std::filesystem::path(file).parent_path() / ".";
}

// Brings the names in the folder of a file to the disk, if the user may read the folder and its
// file system can do that. Returns false on an error of the disk.
bool SyncFolderOf(const std::string& file) {
  const int descriptor = open(FolderOf(file).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return errno == EACCES;
  const bool synced = fsync(descriptor) == 0 || errno == EINVAL;
  close(descriptor);
  return synced;
}

absl::Status CannotWrite(const std::string& file, int error) {
  return absl::InvalidArgumentError(
      absl::StrCat("cannot write ", file, ": ", std::strerror(error)));
}

}  // namespace

DraftFile::DraftFile(const std::string& file) : name_(file), target_(TargetOf(file)) {}

absl::Status DraftFile::Check(const std::string& file) {
  const std::string target = TargetOf(file);
  struct stat there;
  const bool exists = stat(target.c_str(), &there) == 0;
  if (exists && S_ISDIR(there.st_mode)) return CannotWrite(file, EISDIR);
  const bool may_be = exists ? access(target.c_str(), W_OK) == 0
                             : access(FolderOf(target).c_str(), W_OK | X_OK) == 0;
  return may_be ? absl::OkStatus() : CannotWrite(file, errno);
}

// Makes a file that was not there. False, with errno, if the folder takes none.
bool DraftFile::OpenDraft(mode_t mode) {
  for (int i = 1; i <= kMaxDrafts; ++i) {
    draft_ = absl::StrCat(target_, ".part", i == 1 ? "" : absl::StrCat("-", i));
    descriptor_ = open(draft_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (descriptor_ >= 0) {
      removed_at_signal_.emplace(draft_);
      return true;
    }
    if (errno != EEXIST) break;
  }
  draft_.clear();
  return false;
}

absl::StatusOr<std::unique_ptr<DraftFile>> DraftFile::Open(const std::string& file, mode_t mode) {
  std::unique_ptr<DraftFile> draft(new DraftFile(file));
  struct stat there;
  const bool exists = stat(draft->target_.c_str(), &there) == 0;
  if (exists && S_ISDIR(there.st_mode)) return CannotWrite(file, EISDIR);
  if (!exists || S_ISREG(there.st_mode)) {
    if (draft->OpenDraft(exists ? mode & there.st_mode : mode)) return draft;
    // Without room for a draft, the old file stays.
    if (!exists || (errno != EACCES && errno != EPERM && errno != EROFS)) return draft->Failed();
  }
  draft->descriptor_ = open(draft->target_.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC | O_NOCTTY);
  if (draft->descriptor_ < 0) return draft->Failed();
  return draft;
}

DraftFile::~DraftFile() {
  if (descriptor_ < 0) return;
  close(descriptor_);
  if (!draft_.empty()) std::remove(draft_.c_str());
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
  if (draft_.empty() || unsynced_ < kSyncedAtOnce) return absl::OkStatus();
  unsynced_ = 0;
  return fdatasync(descriptor_) == 0 ? absl::OkStatus() : Failed();
}

absl::Status DraftFile::Replace() {
  if (draft_.empty()) {
    // Devices and pipes are on no disk.
    const bool synced = fsync(descriptor_) == 0 || errno == EINVAL || errno == EROFS;
    const bool closed = close(std::exchange(descriptor_, -1)) == 0;
    return synced && closed ? absl::OkStatus() : Failed();
  }
  if (fsync(descriptor_) != 0 || std::rename(draft_.c_str(), target_.c_str()) != 0) {
    return Failed();
  }
  removed_at_signal_.reset();
  close(std::exchange(descriptor_, -1));
  return SyncFolderOf(target_) ? absl::OkStatus() : Failed();
}

absl::Status DraftFile::Failed() const { return CannotWrite(name_, errno); }

}  // namespace polyest::internal
