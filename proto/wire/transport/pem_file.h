#pragma once

// Reads the certificates and keys of TLS from files and checks them before they are used: gRPC
// finds a fault in them only in a handshake, and reports it in words of its own or not at all.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>

namespace polyest::internal {

struct PemFile {
  std::string option;  // that names the file, for messages
  std::string file;
  std::string text;
};

// Reads a file. NOT_FOUND, naming option, file and reason, if that fails.
absl::StatusOr<PemFile> ReadPemFile(const std::string& option, const std::string& file);

// Checks that a file has certificates, all of which can be read. INVALID_ARGUMENT names option,
// file and rule.
absl::Status CheckCertificates(const PemFile& file);

// Checks that the first certificate of a file has not expired, and that the key belongs to it and
// has no passphrase. INVALID_ARGUMENT names option, file and rule.
absl::Status CheckCertificateAndKey(const PemFile& certificate, const PemFile& key);

}  // namespace polyest::internal
