#pragma once

// Serves ExportSession: sends the records of a session, read from the journal as fast as the client
// takes them.

#include <grpcpp/support/server_callback.h>

#include <deque>
#include <memory>
#include <mutex>
#include <optional>

#include "server/service/service_context.h"
#include "server/sessions/session_export.h"

namespace polyest::internal {

using ExportReactor = grpc::ServerWriteReactor<v1::SessionRecord>;

// Holds the state of one export. It outlives its reactor, because the executor may still hold it.
class ExportFlow final : public Drainable, public std::enable_shared_from_this<ExportFlow> {
 public:
  explicit ExportFlow(ServiceContext& context) : context_(context) {}

  // Begins for the caller admitted, or ends the call at once.
  void OnStart(ExportReactor* reactor, const absl::StatusOr<Caller>& admitted,
               const std::string& session);
  void OnWritten(bool ok);
  void OnCancelled();
  void OnDone();
  void Drain() override;

 private:
  // The following are called with the mutex held.
  absl::Status Begin(const Caller& caller, const std::string& session);
  void End(const absl::Status& status);
  void Advance();
  absl::Status StartReading();

  // Reads the next records; runs on the executor.
  void Read();

  ServiceContext& context_;
  std::unique_ptr<SessionExport> export_;
  std::string lane_;

  std::mutex mutex_;
  ExportReactor* reactor_ = nullptr;
  std::deque<v1::SessionRecord> records_;  // the first one is being written or is the next
  bool reading_ = false;
  bool writing_ = false;
  bool finished_ = false;
  std::optional<absl::Status> end_;  // how the export ends, once no more records are read
};

class ExportCall final : public ExportReactor {
 public:
  ExportCall(ServiceContext& context, const grpc::CallbackServerContext& call,
             const std::string& session);

  void OnWriteDone(bool ok) override { flow_->OnWritten(ok); }
  void OnCancel() override { flow_->OnCancelled(); }
  void OnDone() override;

 private:
  std::shared_ptr<ExportFlow> flow_;
  std::unique_ptr<OpenCalls::Ticket> ticket_;
};

}  // namespace polyest::internal
