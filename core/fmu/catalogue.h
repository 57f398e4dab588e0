#pragma once

// The usable FMUs: the *.fmu files of one folder, which the operator owns. A name cannot refer to a
// file outside the folder. The folder is read again on every call, so added, removed and changed
// files are noticed.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "core/fmu/fmu_model.h"

namespace polyest::internal {

// An FMU file that cannot be used, and the reason.
struct BrokenFmu {
  std::string name;
  absl::Status status;
};

// Thread-safe. Copies share their state.
class FmuCatalogue {
 public:
  // Opens a folder. Returns NotFound when there is no such folder.
  static absl::StatusOr<FmuCatalogue> Open(const std::filesystem::path& folder,
                                           const WorkerLimits& limits = {});

  // Returns the usable FMUs, sorted by name.
  std::vector<std::shared_ptr<const Model>> Models() const;
  std::vector<BrokenFmu> Broken() const;

  // Returns the FMU named `name`, the file's name without ".fmu". Returns InvalidArgument if `name`
  // cannot be such a name, NotFound with the available names if there is no such file, and
  // FailedPrecondition with the reason if the FMU cannot be used.
  absl::StatusOr<std::shared_ptr<const Model>> Find(std::string_view name) const;

 private:
  struct Entry {
    std::filesystem::file_time_type written;
    uintmax_t size = 0;
    absl::StatusOr<std::shared_ptr<const FmuModel>> model;
  };
  struct State {
    std::filesystem::path folder;
    WorkerLimits limits;
    std::mutex mutex;
    std::map<std::string, Entry> entries;  // as of the last Refresh
  };

  explicit FmuCatalogue(std::shared_ptr<State> state) : state_(std::move(state)) {}
  // Reads the folder again and updates `entries`. The mutex must be held.
  void Refresh() const;

  std::shared_ptr<State> state_;
};

}  // namespace polyest::internal
