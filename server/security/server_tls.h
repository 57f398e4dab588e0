#pragma once

// Provides the daemon's side of TLS, with certificates that may be exchanged while it serves.

#include <absl/status/statusor.h>
#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "server/security/tls_material.h"

namespace polyest::internal {

// Gives gRPC its certificates in files in memory, into which only checked certificates get. gRPC
// reads its files every second and takes whatever it finds: with half a file, or a certificate
// before its key, no client would get in.
class ServerTls {
 public:
  // Reads the files; errors are those of ReadTlsMaterial.
  static absl::StatusOr<std::unique_ptr<ServerTls>> Open(TlsFiles files);

  // Returns the server's credentials. With a client CA, only clients with a certificate of it get
  // in.
  std::shared_ptr<grpc::ServerCredentials> Credentials() const;

  // Reads the files again; keeps what it has if that fails. New connections use them within a
  // second or two; open connections go on.
  absl::Status Reload();

 private:
  // Holds a file in memory whose content is replaced all at once.
  class MemoryFile {
   public:
    MemoryFile() = default;
    ~MemoryFile();
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;

    absl::Status Replace(const std::string& text);
    std::string path() const;

   private:
    int descriptor_ = -1;
  };

  explicit ServerTls(TlsFiles files) : files_(std::move(files)) {}

  const TlsFiles files_;
  MemoryFile certificate_;
  MemoryFile key_;
  MemoryFile client_ca_;
};

}  // namespace polyest::internal
