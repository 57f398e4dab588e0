#pragma once

// Reads certificates and keys from files.

#include <absl/status/statusor.h>

#include <string>

namespace polyest::internal {

// Names the PEM files.
struct TlsFiles {
  std::string certificate{};  // the daemon's, then those between it and its CA; empty: no TLS
  std::string key{};
  std::string client_ca{};  // clients must have a certificate signed by one of these; empty: none
};

// Holds the contents of the files.
struct TlsMaterial {
  std::string certificate;
  std::string key;
  std::string client_ca;
};

// Reads the files. INVALID_ARGUMENT or NOT_FOUND, naming option, file and rule, unless the files
// can be read, the certificate has not expired, and the key belongs to it and has no passphrase.
// gRPC would find such a fault only in a handshake, and report it to nobody.
absl::StatusOr<TlsMaterial> ReadTlsMaterial(const TlsFiles& files);

}  // namespace polyest::internal
