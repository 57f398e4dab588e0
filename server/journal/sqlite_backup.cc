// Makes backups of the journal while it is written (sqlite_journal.h).

#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "proto/wire/refusal/refusal.h"
#include "server/journal/journal_check.h"
#include "server/journal/sqlite_journal.h"

namespace polyest::internal {
namespace {

// Pages copied before the disk has to keep them. Commits wait for the same disk, and thus for no
// more than these.
constexpr int kPagesAtOnce = 512;
// Room that a backup leaves on the disk for the journal, bytes.
constexpr int64_t kRoomLeft = int64_t{64} << 20;
constexpr mode_t kOwnerOnly = S_IRUSR | S_IWUSR;

// Is a file that is removed when this is destroyed; its descriptor is closed unless released.
class DraftFile {
 public:
  explicit DraftFile(const std::string& name) : name_(name) {
    unlink(name.c_str());
    descriptor_ = open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerOnly);
  }
  ~DraftFile() {
    for (const char* const suffix : {"", "-journal", "-wal", "-shm"}) {
      unlink((name_ + suffix).c_str());
    }
    if (descriptor_ >= 0) close(descriptor_);
  }
  DraftFile(const DraftFile&) = delete;
  DraftFile& operator=(const DraftFile&) = delete;

  int descriptor() const { return descriptor_; }
  int Release() { return std::exchange(descriptor_, -1); }

 private:
  const std::string name_;
  int descriptor_;
};

absl::Status CheckDiskHolds(const std::string& file, SqliteDatabase& source) {
  POLYEST_ASSIGN_OR_RETURN(const int64_t pages, source.Number("PRAGMA page_count"));
  POLYEST_ASSIGN_OR_RETURN(const int64_t page_bytes, source.Number("PRAGMA page_size"));
  struct statvfs disk {};
  if (statvfs(file.c_str(), &disk) != 0) return absl::OkStatus();
  const int64_t room = static_cast<int64_t>(disk.f_bavail) * static_cast<int64_t>(disk.f_frsize);
  const int64_t needed = pages * page_bytes + kRoomLeft;
  if (room >= needed) return absl::OkStatus();
  return Refuse(absl::StatusCode::kResourceExhausted,
                absl::StrFormat("a backup needs %d MiB on the disk of the daemon's data folder, "
                                "which has %d MiB free",
                                needed >> 20, room >> 20),
                {.reason = kDiskFull});
}

// Copies the pages that `from` sees in the transaction that it is in. Because of that transaction
// the copy is never begun anew, however much is written meanwhile.
absl::Status CopyPages(SqliteDatabase& from, SqliteDatabase& to, int descriptor, const Stop& stop) {
  sqlite3_backup* const backup = sqlite3_backup_init(to.handle(), "main", from.handle(), "main");
  if (backup == nullptr) return FromSqlite(sqlite3_errcode(to.handle()), "the backup");
  absl::Status stopped;
  int code = SQLITE_OK;
  while (code == SQLITE_OK && stopped.ok()) {
    code = sqlite3_backup_step(backup, kPagesAtOnce);
    fdatasync(descriptor);
    stopped = stop.Check();
  }
  sqlite3_backup_finish(backup);
  POLYEST_RETURN_IF_ERROR(FromSqlite(code, "the backup"));
  return code == SQLITE_DONE ? absl::OkStatus() : stopped;
}

}  // namespace

// Begins a transaction in which `source` sees the journal as of the last commit, and returns the
// seals as of the same commit. Both are done by the writing thread, between two commits.
absl::StatusOr<std::vector<Seal>> SqliteJournal::BeginSnapshot(SqliteDatabase& source) {
  absl::Status begun;
  std::vector<Seal> seals;
  const auto begin = [&](SqliteDatabase&) {
    begun = source.Execute("BEGIN; SELECT count(*) FROM deleted");
    if (begun.ok()) seals = seals_->All();
    return absl::OkStatus();
  };
  POLYEST_RETURN_IF_ERROR(queue_->Run(begin, "", DiskUse::kFreesRoom));
  POLYEST_RETURN_IF_ERROR(begun);
  return seals;
}

absl::StatusOr<JournalContents> SqliteJournal::CopyTo(const std::string& file, int descriptor,
                                                      const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const auto source, SqliteDatabase::Open(folder_->journal_file()));
  POLYEST_RETURN_IF_ERROR(CheckDiskHolds(file, *source));
  POLYEST_ASSIGN_OR_RETURN(const auto copy, SqliteDatabase::Open(file));
  // What is copied is synced here; nobody needs a half of it.
  POLYEST_RETURN_IF_ERROR(copy->Execute("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF"));
  POLYEST_ASSIGN_OR_RETURN(const std::vector<Seal> seals, BeginSnapshot(*source));
  POLYEST_RETURN_IF_ERROR(CopyPages(*source, *copy, descriptor, stop));
  // The log of the journal may become short again.
  POLYEST_RETURN_IF_ERROR(source->Execute("COMMIT"));
  // The copy is to be one file, without a write-ahead log.
  POLYEST_RETURN_IF_ERROR(copy->Execute("PRAGMA journal_mode = DELETE"));
  POLYEST_RETURN_IF_ERROR(WriteBackupSeals(*copy, seals));
  return CheckJournal(*copy, stop);
}

absl::StatusOr<std::unique_ptr<JournalBackup>> SqliteJournal::BackUp(const Stop& stop) {
  auto turn = BackupTurn::Take(backing_up_);
  if (turn == nullptr) {
    return Refuse(absl::StatusCode::kResourceExhausted, "another backup is under way",
                  {.reason = kBusy, .retry_delay = std::chrono::seconds(10)});
  }
  DraftFile draft(folder_->backup_file());
  if (draft.descriptor() < 0) {
    return absl::UnavailableError(
        absl::StrFormat("the file of the backup cannot be made: %s", std::strerror(errno)));
  }
  POLYEST_ASSIGN_OR_RETURN(JournalContents contents,
                           CopyTo(folder_->backup_file(), draft.descriptor(), stop));
  struct stat status {};
  if (fstat(draft.descriptor(), &status) != 0) {
    return absl::UnavailableError(
        absl::StrFormat("the backup cannot be read: %s", std::strerror(errno)));
  }
  return std::make_unique<JournalBackup>(draft.Release(), status.st_size, std::move(contents),
                                         std::move(turn));
}

}  // namespace polyest::internal
