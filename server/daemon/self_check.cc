#include "server/daemon/self_check.h"

#include <grpc/support/time.h>
#include <grpcpp/generic/generic_stub.h>

namespace polyest::internal {

SelfCheck::SelfCheck(grpc::Server& server) : channel_(server.InProcessChannel({})) {}

bool SelfCheck::Answers(std::chrono::milliseconds timeout) const {
  grpc::GenericStub stub(channel_);
  grpc::ClientContext context;
  // The deadline is kept by the monotonic clock, which nobody sets.
  context.set_deadline(gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC),
                                    gpr_time_from_millis(timeout.count(), GPR_TIMESPAN)));
  grpc::CompletionQueue queue;
  // An empty HealthCheckRequest names no service and so asks for the whole server.
  const grpc::Slice empty;
  const grpc::ByteBuffer request(&empty, 1);
  const auto call =
      stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", request, &queue);
  call->StartCall();
  grpc::ByteBuffer response;
  grpc::Status status;
  call->Finish(&response, &status, &queue);
  void* tag = nullptr;
  bool finished = false;
  return queue.Next(&tag, &finished) && finished && status.ok();
}

}  // namespace polyest::internal
