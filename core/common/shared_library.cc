#include "core/common/shared_library.h"

#include <absl/strings/str_cat.h>
#include <dlfcn.h>

namespace polyest::internal {

void SharedLibrary::Unload::operator()(void* handle) const { dlclose(handle); }

absl::StatusOr<SharedLibrary> SharedLibrary::Load(const std::string& path, std::string what) {
  void* const handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle != nullptr) return SharedLibrary(handle, std::move(what));
  const char* const reason = dlerror();
  return absl::UnavailableError(
      absl::StrCat(what, " cannot be loaded: ", reason == nullptr ? "no reason" : reason));
}

void* SharedLibrary::Find(const char* name) const { return dlsym(handle_.get(), name); }

absl::Status SharedLibrary::Missing(const char* name) const {
  return absl::FailedPreconditionError(absl::StrCat(what_, " has no function ", name));
}

}  // namespace polyest::internal
