#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <utility>

namespace polyest::internal {

// A library that is loaded into this process while it runs: an FMU's, or one that few users need
// and that would make every start longer.
class SharedLibrary {
 public:
  // Loads a library, given by its path or the name that the loader looks for; `what` names it in
  // errors. Returns Unavailable with the loader's message if that fails: the file may be gone, or
  // one that it needs.
  static absl::StatusOr<SharedLibrary> Load(const std::string& path, std::string what);

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

  SharedLibrary(void* handle, std::string what) : handle_(handle), what_(std::move(what)) {}
  void* Find(const char* name) const;
  absl::Status Missing(const char* name) const;

  std::unique_ptr<void, Unload> handle_;
  std::string what_;
};

}  // namespace polyest::internal
