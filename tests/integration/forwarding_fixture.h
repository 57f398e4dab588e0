#pragma once

// Daemons of a database that pass calls on to each other.

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "polyest/rpc/error_details.pb.h"
#include "tests/integration/postgres_fixture.h"
#include "tests/integration/security_fixture.h"

namespace polyest::internal {

// A stream that a test reads from with a token.
class WatchOf {
 public:
  WatchOf(v1::SessionService::Stub& stub, const std::string& session,
          std::chrono::seconds at_most = kPatience) {
    context_.set_deadline(std::chrono::system_clock::now() + at_most);
    v1::WatchSessionRequest request;
    request.set_session(session);
    reader_ = stub.WatchSession(&context_, request);
  }
  // Returns the number of the last batch of the next estimate; 0 at the end.
  int64_t Next() {
    v1::WatchSessionResponse response;
    return reader_->Read(&response) ? response.estimate().sequence() : 0;
  }
  // Reads on until the estimate of a batch, or a later one; returns its number, 0 at the end.
  int64_t ReadTo(int64_t sequence) {
    int64_t last = Next();
    while (last > 0 && last < sequence) last = Next();
    return last;
  }
  grpc::Status Finish() { return reader_->Finish(); }
  void Cancel() { context_.TryCancel(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchSessionResponse>> reader_;
};

class ForwardingTest : public PostgresTest {
 protected:
  std::vector<std::string> Sharing(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = Arguments();
    arguments.insert(arguments.end(), {"--node-secret", secret_});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  // Returns the details of a refusal because of another owner; none of any other status.
  static rpc::ErrorInfo InfoOf(const grpc::Status& status) {
    rpc::Status details;
    rpc::ErrorInfo info;
    if (details.ParseFromString(status.error_details()) && details.details_size() > 0) {
      info.ParseFromString(details.details(0).value());
    }
    return info;
  }

  const TestFolder folder_;
  const std::string secret_ = folder_.Write("node.secret", std::string(32, 's') + "\n");
};

}  // namespace polyest::internal
