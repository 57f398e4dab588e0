#pragma once

// The encryption of the HTTP port, by the certificates that gRPC uses.

#include <absl/status/statusor.h>
#include <openssl/types.h>

#include <memory>

#include "server/security/tls_material.h"

namespace polyest::internal {

// Returns what connections are made with. With a client CA, only clients with a certificate of it
// get in. INVALID_ARGUMENT if OpenSSL cannot use the material.
absl::StatusOr<std::shared_ptr<SSL_CTX>> MakeTlsContext(const TlsMaterial& material);

}  // namespace polyest::internal
