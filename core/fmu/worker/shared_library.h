#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <string>

namespace polyest::internal {

// A library loaded into this process: only ever a worker's.
class SharedLibrary {
 public:
  // FAILED_PRECONDITION with the loader's own words.
  static absl::StatusOr<SharedLibrary> Load(const std::string& path);

  // `function` becomes the library's function of that name; FAILED_PRECONDITION if it has none.
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
