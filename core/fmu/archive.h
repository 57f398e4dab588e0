#pragma once

// Reads an FMU's zip archive. Its content is not trusted: names that leave the folder, symbolic
// links and archives that unpack to more than the limits are refused.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

struct zip;

namespace polyest::internal {

struct ArchiveLimits {
  int64_t max_entries = 20'000;
  int64_t max_bytes = int64_t{2} << 30;  // unpacked size of all files together
};

class Archive {
 public:
  // Opens a file. Returns FailedPrecondition for one that is not a zip archive or contains a
  // refused entry.
  static absl::StatusOr<Archive> Open(const std::filesystem::path& file,
                                      const ArchiveLimits& limits = {});

  bool Contains(const std::string& entry) const;
  // Returns a checksum of the names and contents of all entries, as the archive states them.
  uint32_t Checksum() const;
  // Returns the text of an entry. Returns FailedPrecondition if there is no such entry, if it has
  // more than `max_bytes` bytes, or if it is damaged.
  absl::StatusOr<std::string> Read(const std::string& entry, int64_t max_bytes) const;
  // Writes all entries below an existing folder. Returns FailedPrecondition for a damaged archive
  // or one beyond the limits, and ResourceExhausted if a file cannot be written.
  absl::Status Unpack(const std::filesystem::path& folder) const;

 private:
  struct Discard {
    void operator()(zip* archive) const;
  };

  Archive(std::unique_ptr<zip, Discard> archive, const ArchiveLimits& limits)
      : archive_(std::move(archive)), limits_(limits) {}
  absl::Status CheckEntries() const;
  absl::Status UnpackEntry(uint64_t index, const std::filesystem::path& folder,
                           int64_t& bytes_left) const;

  std::unique_ptr<zip, Discard> archive_;
  ArchiveLimits limits_;
};

}  // namespace polyest::internal
