#pragma once

// A folder, which the operator owns, of files that each describe a model: FMUs, or models of
// UM-Bridge servers. A model's name is that of its file without the suffix, so that it cannot refer
// to a file outside the folder. The folder is read again on every call: added, removed and changed
// files are noticed.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "polyest/model.h"

namespace polyest::internal {

// The files that a folder may have.
struct ModelFileKind {
  std::string noun;    // such as "FMU", for messages
  std::string suffix;  // such as ".fmu"
  // Reads one file; `name` is the file's without the suffix. Returns FailedPrecondition with the
  // reason if the model cannot be used.
  std::function<absl::StatusOr<std::shared_ptr<const Model>>(const std::filesystem::path& file,
                                                             const std::string& name)>
      read;
};

// A file that cannot be used, and the reason.
struct BrokenModelFile {
  std::string name;
  absl::Status status;
};

// Thread-safe. Copies share their state.
class ModelFolder {
 public:
  // Opens a folder. Returns NotFound when there is no such folder.
  static absl::StatusOr<ModelFolder> Open(const std::filesystem::path& folder, ModelFileKind kind);

  // Returns the usable models, sorted by name.
  std::vector<std::shared_ptr<const Model>> Models() const;
  std::vector<BrokenModelFile> Broken() const;

  // Returns the model of the file `name`. Returns InvalidArgument if `name` cannot be such a name,
  // NotFound with the available names if there is no such file, and FailedPrecondition with the
  // reason if the model cannot be used.
  absl::StatusOr<std::shared_ptr<const Model>> Find(std::string_view name) const;

 private:
  struct Entry {
    std::filesystem::file_time_type written;
    uintmax_t size = 0;
    absl::StatusOr<std::shared_ptr<const Model>> model;
  };
  struct State {
    std::filesystem::path folder;
    ModelFileKind kind;
    std::mutex mutex;
    std::map<std::string, Entry> entries;  // as of the last Refresh
  };

  explicit ModelFolder(std::shared_ptr<State> state) : state_(std::move(state)) {}
  // Reads the folder again and updates `entries`. The mutex must be held.
  void Refresh() const;

  std::shared_ptr<State> state_;
};

}  // namespace polyest::internal
