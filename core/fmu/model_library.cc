#include "core/fmu/model_library.h"

#include <absl/strings/str_cat.h>

#include <string>

#include "polyest/catalogue.h"

namespace polyest::internal {

std::vector<std::shared_ptr<const Model>> ModelLibrary::Models() const {
  std::vector<std::shared_ptr<const Model>> models(BuiltinModels().begin(), BuiltinModels().end());
  if (fmus_) {
    for (const std::shared_ptr<const Model>& fmu : fmus_->Models()) {
      if (!FindBuiltinModel(fmu->description().name).ok()) models.push_back(fmu);
    }
  }
  return models;
}

absl::StatusOr<std::shared_ptr<const Model>> ModelLibrary::Find(std::string_view name) const {
  absl::StatusOr<std::shared_ptr<const Model>> builtin = FindBuiltinModel(name);
  if (builtin.ok() || !fmus_) return builtin;
  absl::StatusOr<std::shared_ptr<const Model>> fmu = fmus_->Find(name);
  if (fmu.ok() || absl::IsFailedPrecondition(fmu.status())) return fmu;
  return absl::NotFoundError(
      absl::StrCat(builtin.status().message(), "; ", fmu.status().message()));
}

absl::StatusOr<std::shared_ptr<const Model>> ModelLibrary::FindFmu(std::string_view name) const {
  if (fmus_) return fmus_->Find(name);
  return absl::FailedPreconditionError(absl::StrCat(
      "FMU \"", std::string(name), "\" cannot be used: no folder of FMUs was named (--fmu-dir)"));
}

}  // namespace polyest::internal
