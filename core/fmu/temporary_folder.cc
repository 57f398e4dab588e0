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

// Returns a locked descriptor of the file, or −1 if it cannot be opened or another descriptor holds
// the lock.
int Lock(const std::filesystem::path& file, int flags) {
  const int descriptor = open(file.c_str(), flags | O_RDWR | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (descriptor < 0) return -1;
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  close(descriptor);
  return -1;
}

bool IsOwnFolder(const std::filesystem::path& path) {
  struct stat status;
  return lstat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid();
}

// Removes the folders of processes that have ended.
void RemoveAbandoned(const std::filesystem::path& below) {
  std::error_code error;
  for (std::filesystem::directory_iterator entry(below, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::filesystem::path path = entry->path();
    if (!path.filename().string().starts_with(TemporaryFolder::kPrefix)) continue;
    if (!IsOwnFolder(path)) continue;
    const int lock = Lock(path / kLockName, 0);
    if (lock < 0) continue;
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
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
  std::string path = (below / kPrefix).string() + "XXXXXX";
  if (mkdtemp(path.data()) == nullptr) {
    return absl::ResourceExhaustedError(absl::StrFormat("no folder can be made below %s: %s",
                                                        below.string(), std::strerror(errno)));
  }
  const int lock = Lock(std::filesystem::path(path) / kLockName, O_CREAT);
  if (lock < 0) {
    std::filesystem::remove_all(path, error);
    return absl::ResourceExhaustedError(
        absl::StrFormat("the temporary folder %s cannot be locked", path));
  }
  return std::unique_ptr<TemporaryFolder>(new TemporaryFolder(path, lock));
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
  close(lock_);
}

}  // namespace polyest::internal
