#pragma once

// The FMUs that may be used: the *.fmu files of one folder, which is the operator's; nothing
// outside of it can be named. What is in an FMU is found out when it is asked for, so that files
// that come, go or change are seen.

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

// A file that cannot be used, and why.
struct BrokenFmu {
  std::string name;
  absl::Status status;
};

// May be used by several threads at once; a copy is the same catalogue.
class FmuCatalogue {
 public:
  // NOT_FOUND when there is no such folder.
  static absl::StatusOr<FmuCatalogue> Open(const std::filesystem::path& folder,
                                           const WorkerLimits& limits = {});

  // Those that can be used, by name.
  std::vector<std::shared_ptr<const Model>> Models() const;
  std::vector<BrokenFmu> Broken() const;

  // `name` is the file's without ".fmu". NOT_FOUND lists the names there are; INVALID_ARGUMENT for
  // a name that is none; FAILED_PRECONDITION says what is wrong with an FMU that cannot be used.
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
    std::map<std::string, Entry> entries;  // as they were when last looked at
  };

  explicit FmuCatalogue(std::shared_ptr<State> state) : state_(std::move(state)) {}
  // Sees what has changed. With the mutex held.
  void Refresh() const;

  std::shared_ptr<State> state_;
};

}  // namespace polyest::internal
