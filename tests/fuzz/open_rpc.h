#pragma once

// Makes one call of a script as a client: sends and receives bytes.

#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/client_callback.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <vector>

#include "tests/fuzz/rpc_script.h"

namespace polyest::internal {

// A call of a script. The destructor cancels it and waits for its end.
class OpenRpc final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  OpenRpc(grpc::GenericStub& stub, const ScriptCall& call, std::chrono::milliseconds deadline);
  ~OpenRpc() override;

  // Waits for the end of the call, or only for a moment if the service may answer for ever.
  void Await();

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

 private:
  void WriteNext();
  // Checks that each answer is a message of its type, and that no bad request is called the
  // daemon's fault.
  void CheckAnswer();
  void CheckStatus(const grpc::Status& status) const;

  const ScriptCall& call_;
  grpc::ClientContext context_;
  grpc::ByteBuffer answer_;
  std::vector<grpc::ByteBuffer> requests_;
  bool well_formed_ = true;  // whether all requests are
  size_t written_ = 0;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
};

}  // namespace polyest::internal
