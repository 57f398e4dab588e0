#pragma once

// An FMU is a zip archive. What is in it is not trusted: names that leave the folder, symbolic
// links, and archives that unpack to more than the limits are refused.

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
  int64_t max_bytes = int64_t{2} << 30;  // unpacked, all files together
};

class Archive {
 public:
  // FAILED_PRECONDITION for a file that is no zip archive or has an entry that is refused.
  static absl::StatusOr<Archive> Open(const std::filesystem::path& file,
                                      const ArchiveLimits& limits = {});

  bool Contains(const std::string& entry) const;
  // The text of one entry of at most this many bytes.
  absl::StatusOr<std::string> Read(const std::string& entry, int64_t max_bytes) const;
  // Writes all entries below an existing folder.
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
