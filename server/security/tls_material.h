#pragma once

// Certificates and keys, out of files.

#include <absl/status/statusor.h>

#include <string>

namespace polyest::internal {

// Names of PEM files.
struct TlsFiles {
  std::string certificate{};  // the daemon's, then those between it and its CA; empty: no TLS
  std::string key{};
  std::string client_ca{};  // clients must have a certificate signed by one of these; empty: none
};

// What is in them.
struct TlsMaterial {
  std::string certificate;
  std::string key;
  std::string client_ca;
};

// INVALID_ARGUMENT or NOT_FOUND, naming option, file and rule, unless they can be read, the
// certificate has not expired and the key, without a passphrase, is its own. gRPC would find out no
// sooner than in a handshake, and tell nobody.
absl::StatusOr<TlsMaterial> ReadTlsMaterial(const TlsFiles& files);

}  // namespace polyest::internal
