#pragma once

#include <grpcpp/server_context.h>

#include <optional>
#include <string>

namespace polyest::internal {

// Returns the value of a key in the metadata of a call; nothing unless the call has exactly one.
inline std::optional<std::string> OnlyValue(const grpc::ServerContextBase& call, const char* key) {
  const auto& metadata = call.client_metadata();
  if (metadata.count(key) != 1) return std::nullopt;
  const grpc::string_ref value = metadata.find(key)->second;
  return std::string(value.data(), value.size());
}

}  // namespace polyest::internal
