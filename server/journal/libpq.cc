#include "server/journal/libpq.h"

#include <absl/status/statusor.h>

#include <utility>

#include "core/common/check.h"
#include "core/common/shared_library.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

struct LoadedLibpq {
  SharedLibrary library;
  LibpqFunctions functions;
};

absl::StatusOr<LoadedLibpq> Load() {
  POLYEST_ASSIGN_OR_RETURN(SharedLibrary library,
                           SharedLibrary::Load("libpq.so.5", "PostgreSQL's library libpq"));
  LoadedLibpq loaded{std::move(library), {}};
#define POLYEST_LIBPQ_BIND(name) \
  POLYEST_RETURN_IF_ERROR(loaded.library.Bind(#name, loaded.functions.name));
  POLYEST_LIBPQ_FUNCTIONS(POLYEST_LIBPQ_BIND)
#undef POLYEST_LIBPQ_BIND
  return loaded;
}

// It stays loaded: connections may outlive whatever would unload it.
const absl::StatusOr<LoadedLibpq>& Loaded() {
  static const auto* const loaded = new absl::StatusOr<LoadedLibpq>(Load());
  return *loaded;
}

}  // namespace

absl::Status LoadLibpq() { return Loaded().status(); }

const LibpqFunctions& Libpq() {
  POLYEST_CHECK(Loaded().ok());
  return Loaded()->functions;
}

}  // namespace polyest::internal
