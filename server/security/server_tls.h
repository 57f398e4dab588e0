#pragma once

// The daemon's side of TLS, with certificates that may be exchanged while it serves.

#include <absl/status/statusor.h>
#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "server/security/tls_material.h"

namespace polyest::internal {

// gRPC reads the files anew every second and takes whatever it finds: with half a file, or a
// certificate before its key, no client would get in. So it is given files in memory instead, into
// which only what has been checked gets.
class ServerTls {
 public:
  // As ReadTlsMaterial.
  static absl::StatusOr<std::unique_ptr<ServerTls>> Open(TlsFiles files);

  // With a client CA, only clients with a certificate of it get in.
  std::shared_ptr<grpc::ServerCredentials> Credentials() const;

  // Reads the files again, for the connections to come, within a second or two; keeps what it has
  // if that fails. Connections that are open go on.
  absl::Status Reload();
  const TlsFiles& files() const { return files_; }

 private:
  // A file in memory that is replaced at once.
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
