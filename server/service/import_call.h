#pragma once

// Serves ImportSession: takes the records of a session, one at a time.

#include <grpcpp/support/server_callback.h>

#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "server/service/call_stop.h"
#include "server/service/first_message_timer.h"
#include "server/service/service_context.h"
#include "server/sessions/session_import.h"

namespace polyest::internal {

using ImportReactor = grpc::ServerReadReactor<v1::ImportSessionRequest>;

// Holds the state of one import. It outlives its reactor, because the executor may still hold it.
class ImportFlow final : public Drainable, public std::enable_shared_from_this<ImportFlow> {
 public:
  ImportFlow(ServiceContext& context, const grpc::CallbackServerContext& call,
             v1::Session* response)
      : context_(context),
        stop_(call, stop_source_.get_token(), context.max_computing),
        response_(response) {}

  // Begins for the caller admitted, or ends the call at once.
  void OnStart(ImportReactor* reactor, const absl::StatusOr<Caller>& admitted);
  void OnRead(bool ok);
  void OnCancelled();
  void OnDone();
  // Ends the import if nothing has come.
  void OnFirstMessageDue();
  void Drain() override;

 private:
  // The following are called with the mutex held.
  void End(const absl::Status& status);
  void Advance();
  // Destroys the import on the executor, because that waits for the journal, and goes on to end the
  // call: only then, because the daemon may be destroyed at any moment after that.
  void LeaveImport();

  // The following run on the executor.
  void Take();
  absl::Status TakeRequest();
  absl::Status FinishImport();

  ServiceContext& context_;
  std::stop_source stop_source_;
  const CallStop stop_;
  v1::Session* const response_;  // owned by gRPC; valid until the call is finished
  std::unique_ptr<SessionImport> import_;
  std::string lane_;
  v1::ImportSessionRequest request_;  // used in turns by gRPC, which reads, and by the executor

  std::mutex mutex_;
  ImportReactor* reactor_ = nullptr;
  FirstMessageTimer timer_;
  bool any_ = false;  // whether there has been a message or the end
  bool reading_ = false;
  bool working_ = false;
  bool half_closed_ = false;
  bool finished_ = false;
  std::optional<absl::Status> end_;
};

class ImportCall final : public ImportReactor {
 public:
  ImportCall(ServiceContext& context, const grpc::CallbackServerContext& call,
             v1::Session* response);

  void OnReadDone(bool ok) override { flow_->OnRead(ok); }
  void OnCancel() override { flow_->OnCancelled(); }
  void OnDone() override;

 private:
  std::shared_ptr<ImportFlow> flow_;
  std::unique_ptr<OpenCalls::Ticket> ticket_;
};

}  // namespace polyest::internal
