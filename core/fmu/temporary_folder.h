#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>

namespace polyest::internal {

// A folder of this process alone below the system's folder for temporary files (TMPDIR), removed
// with the object. A process that dies leaves its folders behind; the next one to make a folder
// knows them by their lock, which went with the process, and removes them.
class TemporaryFolder {
 public:
  static absl::StatusOr<std::unique_ptr<TemporaryFolder>> Make();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

  // The folders' names begin like this.
  static constexpr char kPrefix[] = "polyest-fmu-";

 private:
  TemporaryFolder(std::filesystem::path path, int lock) : path_(std::move(path)), lock_(lock) {}

  std::filesystem::path path_;
  int lock_;  // descriptor of the locked file in it
};

}  // namespace polyest::internal
