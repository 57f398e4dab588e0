#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <string>

namespace polyest::internal {

// A library loaded into this process. Only workers load libraries.
class SharedLibrary {
 public:
  // Loads the library. Returns FailedPrecondition with the loader's message if that fails.
  static absl::StatusOr<SharedLibrary> Load(const std::string& path);

  // Sets `function` to the library's function of that name. Returns FailedPrecondition if there is
  // none.
  template <class Function>
  absl::Status Bind(const char* name, Function*& function) const {
    void* const symbol = Find(name);
    if (symbol == nullptr) return Missing(name);
    function = reinterpret_cast<Function*>(symbol);
    return absl::OkStatus();
  }

 private:
  struct Unload {
    void operator()(void* handle) const;
  };

  explicit SharedLibrary(void* handle) : handle_(handle) {}
  void* Find(const char* name) const;
  static absl::Status Missing(const char* name);

  std::unique_ptr<void, Unload> handle_;
};

}  // namespace polyest::internal
