#pragma once

// Connects this daemon with the others of its database.

#include <absl/status/statusor.h>
#include <grpcpp/channel.h>

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/security/tls_material.h"

namespace polyest::internal {

// Thread-safe.
class NodeChannels {
 public:
  struct Options {
    std::string ca{};  // PEM file of the CAs of the daemons' certificates; empty: no TLS
    TlsFiles tls{};    // this daemon's certificate, shown to daemons that ask for one
  };

  // Reads the files. NOT_FOUND, naming --node-ca, when they cannot be read.
  static absl::StatusOr<std::unique_ptr<NodeChannels>> Open(Options options);

  // Returns a channel to the daemon at HOST:PORT with room for one more call, which keeps the
  // pointer until it ends.
  std::shared_ptr<grpc::Channel> To(const std::string& address);

  // Reads the files again; keeps what it has if that fails. Calls under way keep their connections.
  absl::Status Reload();

 private:
  struct Material {
    std::string ca;
    TlsMaterial own;
  };

  explicit NodeChannels(Options options) : options_(std::move(options)) {}
  std::shared_ptr<grpc::Channel> Connect(const std::string& address) const;

  const Options options_;
  std::mutex mutex_;
  Material material_;
  std::map<std::string, std::vector<std::shared_ptr<grpc::Channel>>> channels_;  // by address
};

}  // namespace polyest::internal
