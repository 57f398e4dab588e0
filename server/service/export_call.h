#pragma once

// Serves ExportSession: sends the records of a session, read from the journal as fast as the client
// takes them.

#include <grpcpp/support/server_callback.h>

#include <memory>
#include <string>

#include "server/service/record_flow.h"
#include "server/service/service_context.h"

namespace polyest::internal {

class ExportCall final : public grpc::ServerWriteReactor<v1::SessionRecord> {
 public:
  ExportCall(ServiceContext& context, grpc::CallbackServerContext& call,
             const v1::ExportSessionRequest& request);

  void OnWriteDone(bool ok) override { flow_->OnWritten(ok); }
  void OnCancel() override { flow_->OnCancelled(); }
  void OnDone() override;

 private:
  std::shared_ptr<RecordFlow<v1::SessionRecord>> flow_;
  std::unique_ptr<OpenCalls::Ticket> ticket_;
};

}  // namespace polyest::internal
