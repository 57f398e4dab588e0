#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>

namespace polyest::internal {

// A private folder below the system's folder for temporary files (TMPDIR). It is removed with the
// object. A process that crashes leaves its folders behind; the lock in them is released with the
// process. The next Make, in any process, recognizes such folders by the missing lock and removes
// them.
class TemporaryFolder {
 public:
  // Makes the folder, and removes abandoned ones. Returns ResourceExhausted if it cannot be made.
  static absl::StatusOr<std::unique_ptr<TemporaryFolder>> Make();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

  // Prefix of the folders' names.
  static constexpr char kPrefix[] = "polyest-fmu-";

 private:
  TemporaryFolder(std::filesystem::path path, int lock) : path_(std::move(path)), lock_(lock) {}

  std::filesystem::path path_;
  int lock_;  // descriptor of the locked file in the folder
};

}  // namespace polyest::internal
