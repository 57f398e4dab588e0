#include "server/journal/data_folder.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

namespace fs = std::filesystem;

constexpr char kJournal[] = "journal.db";
constexpr char kLock[] = "lock";
constexpr char kSeals[] = "seals";
constexpr char kBackup[] = "backup.db";
constexpr char kReserve[] = "reserve";
constexpr mode_t kFolderMode = 0700;
constexpr mode_t kFileMode = 0600;
// The bits of a mode by which the group and all others may read, write or enter.
constexpr mode_t kOthers = 0077;
constexpr mode_t kPermissions = 07777;

std::string ErrnoText() { return std::strerror(errno); }

// Returns whether a file is the journal's own: its lock, its seals, its reserve, SQLite's file
// or a backup of it, or one that SQLite puts beside these.
bool IsOwn(const std::string& name) {
  return name == kLock || name == kSeals || name == kReserve || absl::StartsWith(name, kJournal) ||
         absl::StartsWith(name, kBackup);
}

// Returns the permissions of a file or folder.
absl::StatusOr<mode_t> ModeOf(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0) return status.st_mode & kPermissions;
  return absl::FailedPreconditionError(absl::StrFormat("cannot read %s: %s", path, ErrnoText()));
}

// Closes a file or folder to others. Some file systems take a new mode without an error and keep
// the old one, so the mode is read again.
absl::Status ClosePath(const std::string& path, mode_t old_mode, mode_t mode) {
  const bool changed = chmod(path.c_str(), mode) == 0;
  const std::string why = changed ? "its file system keeps no permissions" : ErrnoText();
  POLYEST_ASSIGN_OR_RETURN(const mode_t now, ModeOf(path));
  if ((now & kOthers) == 0) {
    spdlog::warn("{} was open to other users (mode {:04o}), and is no more ({:04o})", path,
                 static_cast<unsigned>(old_mode), static_cast<unsigned>(now));
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(absl::StrFormat(
      "%s is open to other users (mode %04o) and cannot be closed to them (%s); as its owner, "
      "chmod %04o it",
      path, now, why, mode));
}

absl::Status MakeFolder(const std::string& folder) {
  std::error_code error;
  fs::path path = fs::path(folder).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();  // without the slash at the end
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  if (!error && mkdir(path.c_str(), kFolderMode) != 0 && errno != EEXIST) {
    error = std::error_code(errno, std::generic_category());
  }
  if (!error && !fs::is_directory(path, error) && !error) {
    error = std::make_error_code(std::errc::not_a_directory);
  }
  if (!error) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrFormat("cannot make the folder %s: %s", folder, error.message()));
}

absl::Status MakeFolderPrivate(const std::string& folder) {
  POLYEST_ASSIGN_OR_RETURN(const mode_t mode, ModeOf(folder));
  if ((mode & kOthers) == 0) return absl::OkStatus();
  // The folder may hold something for others to use, as /tmp does.
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (IsOwn(name)) continue;
    return absl::FailedPreconditionError(absl::StrFormat(
        "the folder %s is open to other users (mode %04o) and holds other files (%s); chmod %04o "
        "it, or give the daemon a folder of its own",
        folder, mode, name, kFolderMode));
  }
  return ClosePath(folder, mode, kFolderMode);
}

// Makes the files private that an earlier version, which left their mode to the umask, has made.
absl::Status MakeFilesPrivate(const std::string& folder) {
  for (const char* name : {kLock, kSeals, kReserve, kJournal, "journal.db-wal", "journal.db-shm"}) {
    const std::string file = absl::StrCat(folder, "/", name);
    std::error_code ignored;
    if (!fs::exists(file, ignored)) continue;
    POLYEST_ASSIGN_OR_RETURN(const mode_t mode, ModeOf(file));
    if ((mode & kOthers) != 0) POLYEST_RETURN_IF_ERROR(ClosePath(file, mode, kFileMode));
  }
  return absl::OkStatus();
}

// Makes the journal's file. SQLite would do it later, but leave the mode to the umask.
absl::Status MakeJournalFile(const std::string& file) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kFileMode);
  if (descriptor >= 0) {
    close(descriptor);
  } else if (errno != EEXIST) {
    return absl::FailedPreconditionError(
        absl::StrFormat("cannot make the file %s: %s", file, ErrnoText()));
  }
  return absl::OkStatus();
}

// Removes what a backup has left that was being made when the daemon was killed.
void RemoveBackup(const std::string& file) {
  for (const char* const suffix : {"", "-journal", "-wal", "-shm"}) {
    unlink((file + suffix).c_str());
  }
}

// Locks the folder for this process and returns the descriptor of the locked file.
absl::StatusOr<int> Lock(const std::string& folder) {
  const std::string file = absl::StrCat(folder, "/", kLock);
  const int descriptor = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kFileMode);
  if (descriptor < 0) {
    return absl::FailedPreconditionError(
        absl::StrFormat("cannot write to the folder %s: %s", folder, ErrnoText()));
  }
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  close(descriptor);
  return absl::FailedPreconditionError(
      absl::StrFormat("another daemon uses the folder %s; give each one its own", folder));
}

}  // namespace

absl::StatusOr<std::unique_ptr<DataFolder>> DataFolder::Take(const std::string& folder) {
  POLYEST_RETURN_IF_ERROR(MakeFolder(folder));
  POLYEST_RETURN_IF_ERROR(MakeFolderPrivate(folder));
  POLYEST_ASSIGN_OR_RETURN(const int lock, Lock(folder));
  std::unique_ptr<DataFolder> taken(new DataFolder(folder, lock));
  RemoveBackup(taken->backup_file());
  POLYEST_RETURN_IF_ERROR(MakeFilesPrivate(folder));
  POLYEST_RETURN_IF_ERROR(MakeJournalFile(taken->journal_file()));
  POLYEST_RETURN_IF_ERROR(taken->LockJournal());
  return taken;
}

DataFolder::DataFolder(const std::string& folder, int lock)
    : journal_file_(absl::StrCat(folder, "/", kJournal)),
      seals_file_(absl::StrCat(folder, "/", kSeals)),
      backup_file_(absl::StrCat(folder, "/", kBackup)),
      reserve_file_(absl::StrCat(folder, "/", kReserve)),
      lock_(lock) {}

absl::Status DataFolder::LockJournal() {
  journal_lock_ = open(journal_file_.c_str(), O_RDONLY | O_CLOEXEC);
  if (journal_lock_ >= 0 && flock(journal_lock_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "another daemon uses %s, though not the lock beside it; stop it first", journal_file_));
  }
  return absl::OkStatus();
}

DataFolder::~DataFolder() {
  if (journal_lock_ >= 0) close(journal_lock_);
  close(lock_);
}

}  // namespace polyest::internal
