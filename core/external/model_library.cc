#include "core/external/model_library.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <string>

#include "polyest/catalogue.h"

namespace polyest::internal {

std::vector<std::shared_ptr<const Model>> ModelLibrary::Models() const {
  std::vector<std::shared_ptr<const Model>> models(BuiltinModels().begin(), BuiltinModels().end());
  for (const std::optional<ModelFolder>* folder : {&fmus_, &umbridge_}) {
    if (!*folder) continue;
    for (const std::shared_ptr<const Model>& model : (*folder)->Models()) {
      const bool known = std::ranges::any_of(models, [&](const auto& other) {
        return other->description().name == model->description().name;
      });
      if (!known) models.push_back(model);
    }
  }
  return models;
}

absl::StatusOr<std::shared_ptr<const Model>> ModelLibrary::Find(std::string_view name) const {
  absl::StatusOr<std::shared_ptr<const Model>> found = FindBuiltinModel(name);
  std::string tried(found.status().message());
  for (const std::optional<ModelFolder>* folder : {&fmus_, &umbridge_}) {
    if (found.ok() || absl::IsFailedPrecondition(found.status())) return found;
    if (!*folder) continue;
    found = (*folder)->Find(name);
    absl::StrAppend(&tried, "; ", found.status().message());
  }
  if (found.ok() || absl::IsFailedPrecondition(found.status())) return found;
  return absl::NotFoundError(tried);
}

absl::StatusOr<std::shared_ptr<const Model>> ModelLibrary::FindFmu(std::string_view name) const {
  if (fmus_) return fmus_->Find(name);
  return absl::FailedPreconditionError(
      absl::StrFormat("FMU \"%s\" cannot be used: no folder of FMUs was named (--fmu-dir)", name));
}

absl::StatusOr<std::shared_ptr<const Model>> ModelLibrary::FindUmBridge(
    std::string_view name) const {
  if (umbridge_) return umbridge_->Find(name);
  return absl::FailedPreconditionError(absl::StrFormat(
      "UM-Bridge model \"%s\" cannot be used: no folder of them was named (--umbridge-dir)", name));
}

}  // namespace polyest::internal
