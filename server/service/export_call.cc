#include "server/service/export_call.h"

#include <utility>

#include "core/common/status.h"
#include "proto/wire/operations/names.h"
#include "server/service/stream_admission.h"
#include "server/sessions/session_export.h"

namespace polyest::internal {
namespace {

using ExportFlow = RecordFlow<v1::SessionRecord>;

absl::StatusOr<ExportFlow::Next> RecordsOf(const ServiceContext& context, const Caller& caller,
                                           const std::string& session) {
  POLYEST_RETURN_IF_ERROR(ResourceId("name", "sessions", session).status());
  if (!context.sessions.shared()) {
    POLYEST_RETURN_IF_ERROR(context.sessions.Get(caller.tenant, session).status());
  }
  // Looking for it may wait, as the records do.
  const auto records = std::make_shared<std::unique_ptr<SessionExport>>();
  return [records, &context, tenant = caller.tenant,
          session](const Stop&) -> absl::StatusOr<std::vector<v1::SessionRecord>> {
    if (*records == nullptr) {
      POLYEST_ASSIGN_OR_RETURN(auto found, context.sessions.Find(tenant, session));
      *records = std::make_unique<SessionExport>(std::move(found));
    }
    return (*records)->Next();
  };
}

ExportFlow::PassOn PassOnFor(const ServiceContext& context, grpc::CallbackServerContext& call,
                             const v1::ExportSessionRequest& request) {
  if (context.nodes == nullptr) return nullptr;
  return
      [&context, &call, request](ExportFlow::Reactor* reactor,
                                 const absl::Status& refusal) -> std::shared_ptr<PassedOnStream> {
        std::optional<NodeForwarder::Passage> passage = context.nodes->PassageFor(call, refusal);
        if (!passage) return nullptr;
        using Relay = StreamRelay<v1::ExportSessionRequest, v1::SessionRecord, ExportFlow::Reactor>;
        return Relay::Start(*std::move(passage), PathOf("ExportSession"), call, reactor, request);
      };
}

}  // namespace

ExportCall::ExportCall(ServiceContext& context, grpc::CallbackServerContext& call,
                       const v1::ExportSessionRequest& request)
    : flow_(std::make_shared<ExportFlow>(context.executor, context.calls.memory(),
                                         PassOnFor(context, call, request))) {
  const absl::StatusOr<Caller> admitted =
      AdmitStream(context, call, "ExportSession", OpenCalls::Kind::kWatcher, flow_, ticket_);
  if (!admitted.ok()) {
    flow_->OnStart(this, "", admitted.status());
    return;
  }
  flow_->OnStart(this, admitted->tenant, RecordsOf(context, *admitted, request.name()));
}

void ExportCall::OnDone() {
  flow_->OnDone();
  delete this;
}

}  // namespace polyest::internal
