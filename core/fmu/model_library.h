#pragma once

// The models that can be referred to by name: the built-in models and the FMUs of an optional
// folder.

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/fmu/catalogue.h"
#include "polyest/model.h"

namespace polyest::internal {

// Thread-safe.
class ModelLibrary {
 public:
  // Makes a library of the built-in models alone.
  ModelLibrary() = default;
  explicit ModelLibrary(FmuCatalogue fmus) : fmus_(std::move(fmus)) {}

  // Returns the built-in models, then the usable FMUs. An FMU with the name of a built-in model is
  // left out.
  std::vector<std::shared_ptr<const Model>> Models() const;
  // Returns the model of that name; a built-in model takes precedence over an FMU. Returns NotFound
  // with the names of the built-in models, and of the FMUs if there is a folder of them. Returns
  // FailedPrecondition for an FMU that cannot be used.
  absl::StatusOr<std::shared_ptr<const Model>> Find(std::string_view name) const;
  // Returns the FMU as FmuCatalogue::Find does, or FailedPrecondition if there is no folder of
  // FMUs.
  absl::StatusOr<std::shared_ptr<const Model>> FindFmu(std::string_view name) const;

 private:
  std::optional<FmuCatalogue> fmus_;
};

}  // namespace polyest::internal
