#pragma once

// Holds a backup of a journal: a copy of everything that it kept at one moment, as one file that no
// name leads to, so that nothing is left of it when the process ends.

#include <absl/status/statusor.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace polyest::internal {

// Describes what a journal's file has.
struct JournalContents {
  int64_t sessions = 0;
  int64_t batches = 0;
  std::vector<std::string> damage{};  // what is damaged or missing, a sentence each
};

// Lets one backup at a time be made or read.
class BackupTurn {
 public:
  // Takes the turn; null while another backup has it.
  static std::unique_ptr<BackupTurn> Take(const std::shared_ptr<std::atomic<bool>>& taken);
  ~BackupTurn() { *taken_ = false; }
  BackupTurn(const BackupTurn&) = delete;
  BackupTurn& operator=(const BackupTurn&) = delete;

 private:
  explicit BackupTurn(std::shared_ptr<std::atomic<bool>> taken) : taken_(std::move(taken)) {}

  const std::shared_ptr<std::atomic<bool>> taken_;
};

class JournalBackup {
 public:
  // Takes over the descriptor of the file, which has `bytes` bytes.
  JournalBackup(int descriptor, int64_t bytes, JournalContents contents,
                std::unique_ptr<BackupTurn> turn);
  ~JournalBackup();
  JournalBackup(const JournalBackup&) = delete;
  JournalBackup& operator=(const JournalBackup&) = delete;

  int64_t bytes() const { return bytes_; }
  const JournalContents& contents() const { return contents_; }
  // Returns the bytes from `offset` on, `most` of them or those up to the end. UNAVAILABLE when the
  // disk fails.
  absl::StatusOr<std::string> Read(int64_t offset, size_t most) const;

 private:
  const int descriptor_;
  const int64_t bytes_;
  const JournalContents contents_;
  const std::unique_ptr<BackupTurn> turn_;
};

}  // namespace polyest::internal
