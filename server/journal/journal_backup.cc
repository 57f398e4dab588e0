#include "server/journal/journal_backup.h"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "server/journal/session_journal.h"

namespace polyest::internal {

std::unique_ptr<BackupTurn> BackupTurn::Take(const std::shared_ptr<std::atomic<bool>>& taken) {
  if (taken->exchange(true)) return nullptr;
  return std::unique_ptr<BackupTurn>(new BackupTurn(taken));
}

JournalBackup::JournalBackup(int descriptor, int64_t bytes, JournalContents contents,
                             std::unique_ptr<BackupTurn> turn)
    : descriptor_(descriptor),
      bytes_(bytes),
      contents_(std::move(contents)),
      turn_(std::move(turn)) {}

JournalBackup::~JournalBackup() { close(descriptor_); }

absl::StatusOr<std::unique_ptr<JournalBackup>> SessionJournal::BackUp(const Stop&) {
  return absl::FailedPreconditionError(
      "the daemon keeps its sessions in memory only (--durability memory): there is nothing to "
      "back "
      "up");
}

absl::StatusOr<std::string> JournalBackup::Read(int64_t offset, size_t most) const {
  std::string bytes(std::min<size_t>(most, static_cast<size_t>(bytes_ - offset)), '\0');
  size_t read = 0;
  while (read < bytes.size()) {
    const ssize_t more = pread(descriptor_, bytes.data() + read, bytes.size() - read,
                               offset + static_cast<off_t>(read));
    if (more < 0 && errno == EINTR) continue;
    if (more <= 0) {
      return absl::UnavailableError(
          absl::StrCat("the backup cannot be read: ",
                       more == 0 ? "it has become shorter" : std::strerror(errno)));
    }
    read += static_cast<size_t>(more);
  }
  return bytes;
}

}  // namespace polyest::internal
