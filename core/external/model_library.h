#pragma once

// The models that can be referred to by name: the built-in models, and those of two optional
// folders, FMUs and models of UM-Bridge servers.

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/external/model_folder.h"
#include "polyest/model.h"

namespace polyest::internal {

// Thread-safe.
class ModelLibrary {
 public:
  // Makes a library of the built-in models alone.
  ModelLibrary() = default;
  ModelLibrary(std::optional<ModelFolder> fmus, std::optional<ModelFolder> umbridge)
      : fmus_(std::move(fmus)), umbridge_(std::move(umbridge)) {}

  // Returns the built-in models, then the usable FMUs, then those of UM-Bridge servers. One with
  // the name of an earlier one is left out.
  std::vector<std::shared_ptr<const Model>> Models() const;
  // Returns the model of that name, the first of them in the order of Models. Returns NotFound with
  // the names that there are, FailedPrecondition for one that cannot be used.
  absl::StatusOr<std::shared_ptr<const Model>> Find(std::string_view name) const;
  // Return the model of a folder as ModelFolder::Find does, or FailedPrecondition if there is no
  // such folder.
  absl::StatusOr<std::shared_ptr<const Model>> FindFmu(std::string_view name) const;
  absl::StatusOr<std::shared_ptr<const Model>> FindUmBridge(std::string_view name) const;

 private:
  std::optional<ModelFolder> fmus_;
  std::optional<ModelFolder> umbridge_;
};

}  // namespace polyest::internal
