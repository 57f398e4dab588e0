#pragma once

// Manages the folder in which a journal is kept. Measurements are their owner's business: only the
// user that the daemon runs as may read the folder and the files in it, and only one daemon at a
// time may use it.

#include <absl/status/statusor.h>

#include <memory>
#include <string>

namespace polyest::internal {

class DataFolder {
 public:
  // Takes the folder for this process and makes its files private: mode 0700, and 0600 for the
  // files. Makes the folder, and its parents, if there is none. A folder that others may read is
  // closed to them when it holds nothing but a journal.
  //
  // FAILED_PRECONDITION names the folder or file and what to do: if it cannot be made or written
  // to, if another daemon uses it, or if others may read it and this process may not change that.
  static absl::StatusOr<std::unique_ptr<DataFolder>> Take(const std::string& folder);
  // Releases the folder for another daemon.
  ~DataFolder();
  DataFolder(const DataFolder&) = delete;
  DataFolder& operator=(const DataFolder&) = delete;

  // Returns the path of the journal's file. SQLite gives the files that it puts beside it the same
  // mode.
  const std::string& journal_file() const { return journal_file_; }
  // Returns the path of a backup that is being made.
  const std::string& backup_file() const { return backup_file_; }
  // Returns the path of the file of seals (SessionSeals).
  const std::string& seals_file() const { return seals_file_; }
  // Returns the path of the file of the DiskReserve.
  const std::string& reserve_file() const { return reserve_file_; }

 private:
  DataFolder(const std::string& folder, int lock);
  // Locks the journal's file, too, because anybody may remove the lock's file, which then locks
  // nothing.
  absl::Status LockJournal();

  const std::string journal_file_;
  const std::string seals_file_;
  const std::string backup_file_;
  const std::string reserve_file_;
  const int lock_;         // descriptor of the locked file
  int journal_lock_ = -1;  // and of the journal's. Once it is closed, SQLite's locks are gone
};

}  // namespace polyest::internal
