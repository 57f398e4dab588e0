#pragma once

// The models that have a name here: the built-in ones, and the FMUs of a folder if there is one.

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/fmu/catalogue.h"
#include "polyest/model.h"

namespace polyest::internal {

// May be used by several threads at once.
class ModelLibrary {
 public:
  // The built-in models alone.
  ModelLibrary() = default;
  explicit ModelLibrary(FmuCatalogue fmus) : fmus_(std::move(fmus)) {}

  // The built-in models, then the FMUs that can be used; no two of the same name: an FMU with that
  // of a built-in model is left out.
  std::vector<std::shared_ptr<const Model>> Models() const;
  // By name, a built-in model before an FMU. NOT_FOUND lists the names of the built-in models, or
  // of the FMUs when there are some; FAILED_PRECONDITION for an FMU that cannot be used.
  absl::StatusOr<std::shared_ptr<const Model>> Find(std::string_view name) const;
  // As FmuCatalogue::Find; FAILED_PRECONDITION without a folder of FMUs.
  absl::StatusOr<std::shared_ptr<const Model>> FindFmu(std::string_view name) const;

 private:
  std::optional<FmuCatalogue> fmus_;
};

}  // namespace polyest::internal
