#pragma once

// One call of a script, from the client's side: bytes out and bytes in.

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

// Has ended when it goes: the destructor cancels it and waits.
class OpenRpc final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  OpenRpc(grpc::GenericStub& stub, const ScriptCall& call, std::chrono::milliseconds deadline);
  ~OpenRpc() override;

  // Until it has ended or, if the service may answer for ever, for a moment.
  void Await();

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

 private:
  void WriteNext();
  // An answer is a message of its type, and what is wrong with a request is never the daemon's
  // fault.
  void CheckAnswer();
  void CheckStatus(const grpc::Status& status) const;

  const ScriptCall& call_;
  grpc::ClientContext context_;
  grpc::ByteBuffer answer_;
  std::vector<grpc::ByteBuffer> requests_;
  bool well_formed_ = true;  // the requests
  size_t written_ = 0;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
};

}  // namespace polyest::internal
