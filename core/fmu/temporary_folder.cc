#include "core/fmu/temporary_folder.h"

#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

namespace polyest::internal {
namespace {

constexpr char kLockName[] = ".lock";

// Largest number of folders made for one that no other process takes for an abandoned one.
constexpr int kAttempts = 100;

// Locks the file, which is made if there is none, and returns its descriptor. Returns −1 if that
// fails, another descriptor holds the lock, or the file has been removed meanwhile.
int Lock(const std::filesystem::path& file) {
  const int descriptor = open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (descriptor < 0) return -1;
  struct stat status;
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0 && fstat(descriptor, &status) == 0 &&
      status.st_nlink > 0) {
    return descriptor;
  }
  close(descriptor);
  return -1;
}

bool IsOwnFolder(const std::filesystem::path& path) {
  struct stat status;
  return lstat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid();
}

// Removes the folders of processes that have ended. One may have ended before it locked its folder,
// so a folder without a lock is removed, too; a process that is just making it then makes another.
void RemoveAbandoned(const std::filesystem::path& below) {
  std::error_code error;
  for (std::filesystem::directory_iterator entry(below, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::filesystem::path path = entry->path();
    if (!path.filename().string().starts_with(TemporaryFolder::kPrefix)) continue;
    if (!IsOwnFolder(path)) continue;
    const int lock = Lock(path / kLockName);
    if (lock < 0) continue;
    // The new name keeps a process that is just making the folder from locking it again meanwhile.
    std::filesystem::path abandoned = path;
    abandoned += "-abandoned";
    std::error_code ignored;
    std::filesystem::rename(path, abandoned, ignored);
    std::filesystem::remove_all(abandoned, ignored);
    close(lock);
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<TemporaryFolder>> TemporaryFolder::Make() {
  std::error_code error;
  const std::filesystem::path below = std::filesystem::temp_directory_path(error);
  if (error) {
    return absl::ResourceExhaustedError("there is no folder for temporary files; set TMPDIR");
  }
  RemoveAbandoned(below);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    std::string path = (below / kPrefix).string() + "XXXXXX";
    if (mkdtemp(path.data()) == nullptr) {
      return absl::ResourceExhaustedError(absl::StrFormat("no folder can be made below %s: %s",
                                                          below.string(), std::strerror(errno)));
    }
    const int lock = Lock(std::filesystem::path(path) / kLockName);
    if (lock >= 0) return std::unique_ptr<TemporaryFolder>(new TemporaryFolder(path, lock));
    std::filesystem::remove_all(path, error);
  }
  return absl::ResourceExhaustedError(
      absl::StrFormat("no temporary folder below %s can be locked", below.string()));
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
  close(lock_);
}

}  // namespace polyest::internal
