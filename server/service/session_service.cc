#include "core/common/status.h"
#include "polyest/v1/session_service.grpc.pb.h"
#include "proto/wire/operations/names.h"
#include "proto/wire/operations/pages.h"
#include "proto/wire/refusal/refusal.h"
#include "server/service/calls.h"
#include "server/service/catch_up.h"
#include "server/service/export_call.h"
#include "server/service/import_call.h"
#include "server/service/measurement_stream.h"
#include "server/service/services.h"
#include "server/service/session_watch.h"

namespace polyest::internal {
namespace {

// The most bytes of a session's message besides its problem: of its name, and of some 20 numbers.
constexpr size_t kDescriptionBytes = 1 << 10;

absl::StatusOr<v1::ListSessionsResponse> ListPage(SessionRegistry& sessions,
                                                  const std::string& tenant,
                                                  const v1::ListSessionsRequest& request) {
  POLYEST_ASSIGN_OR_RETURN(const size_t page_size, PageSize(request.page_size()));
  if (!request.page_token().empty() &&
      !ResourceId("pageToken", "sessions", request.page_token()).ok()) {
    return UnknownPageToken(request.page_token());
  }
  // One session more than asked for tells whether there is another page.
  POLYEST_ASSIGN_OR_RETURN(auto page, sessions.List(tenant, request.page_token(), page_size + 1));
  v1::ListSessionsResponse response;
  if (page.size() > page_size) {
    page.pop_back();
    response.set_next_page_token(page.back()->name());
  }
  for (const auto& session : page) *response.add_sessions() = session->Describe();
  return response;
}

class SessionService final : public v1::SessionService::CallbackService {
 public:
  explicit SessionService(const ServiceContext& context) : context_(context) {}

  using Unary = grpc::ServerUnaryReactor;
  using Context = grpc::CallbackServerContext;

  Unary* CreateSession(Context* call, const v1::CreateSessionRequest* request,
                       v1::Session* response) override;
  Unary* GetSession(Context* call, const v1::GetSessionRequest* request,
                    v1::Session* response) override;
  Unary* ListSessions(Context* call, const v1::ListSessionsRequest* request,
                      v1::ListSessionsResponse* response) override;
  Unary* DeleteSession(Context* call, const v1::DeleteSessionRequest* request,
                       google::protobuf::Empty* response) override;

  grpc::ServerWriteReactor<v1::SessionRecord>* ExportSession(
      Context* call, const v1::ExportSessionRequest* request) override {
    return new ExportCall(context_, *call, *request);
  }
  grpc::ServerReadReactor<v1::ImportSessionRequest>* ImportSession(Context* call,
                                                                   v1::Session* response) override {
    return new ImportCall(context_, *call, response);
  }

  Unary* AddMeasurements(Context* call, const v1::AddMeasurementsRequest* request,
                         v1::AddMeasurementsResponse* response) override;
  Unary* GetEstimate(Context* call, const v1::GetEstimateRequest* request,
                     v1::Estimate* response) override;
  Unary* GetHistory(Context* call, const v1::GetHistoryRequest* request,
                    v1::GetHistoryResponse* response) override {
    return OnStrand({call, "GetHistory", request, response}, request->session(),
                    [=](const std::shared_ptr<Session>& session, const Stop&) -> absl::Status {
                      POLYEST_ASSIGN_OR_RETURN(*response->mutable_history(), session->History());
                      return absl::OkStatus();
                    });
  }
  grpc::ServerBidiReactor<v1::StreamMeasurementsRequest, v1::StreamMeasurementsResponse>*
  StreamMeasurements(Context* call) override {
    return new MeasurementStream(context_, *call);
  }
  grpc::ServerWriteReactor<v1::WatchSessionResponse>* WatchSession(
      Context* call, const v1::WatchSessionRequest* request) override {
    return new SessionWatch(context_, *call, *request);
  }

 private:
  // Starts a call that is soon done.
  Unary* ForCaller(const UnaryCall::Call& call, CallerWork work) {
    return StartCall(context_, call, [&](const Caller& caller) {
      return ShortJobOfCaller(context_, caller, std::move(work));
    });
  }
  Unary* OnStrand(const UnaryCall::Call& call, const std::string& session, SessionWork work) {
    return StartCall(context_, call, [&](const Caller& caller) {
      return JobOfSession(context_, caller, "session", session, std::move(work));
    });
  }

  // Refuses a new session that another daemon is to have, so that the call is passed on to that.
  absl::Status CheckPlacedHere(const Context& call) const {
    if (context_.placement == nullptr || context_.access.IsPassedOn(call)) return absl::OkStatus();
    const std::optional<std::string> address = context_.placement->Elsewhere();
    if (!address) return absl::OkStatus();
    return Refuse(absl::StatusCode::kUnavailable, "another daemon has less to do",
                  {.reason = kOwnedElsewhere, .owner = *address});
  }

  ServiceContext context_;
};

SessionService::Unary* SessionService::CreateSession(Context* call,
                                                     const v1::CreateSessionRequest* request,
                                                     v1::Session* response) {
  // If the daemon that was chosen does not take it, this one does.
  const auto placed = std::make_shared<bool>(false);
  const size_t answer_bytes = request->session().problem().ByteSizeLong() + kDescriptionBytes;
  return ForCaller({.context = call,
                    .method = "CreateSession",
                    .request = request,
                    .answer = response,
                    .anywhere = true,
                    .answer_bytes = static_cast<int64_t>(answer_bytes)},
                   [=, this](const Caller& caller, const Stop& stop) -> absl::Status {
                     if (!std::exchange(*placed, true)) {
                       POLYEST_RETURN_IF_ERROR(CheckPlacedHere(*call));
                     }
                     const v1::Problem& problem = request->session().problem();
                     POLYEST_ASSIGN_OR_RETURN(
                         const auto session,
                         context_.sessions.Create(caller.tenant, request->session_id(), problem,
                                                  request->session().reorder_window_s(), stop));
                     *response = session->Describe();
                     *response->mutable_problem() = problem;
                     return absl::OkStatus();
                   });
}

SessionService::Unary* SessionService::GetSession(Context* call,
                                                  const v1::GetSessionRequest* request,
                                                  v1::Session* response) {
  return ForCaller({call, "GetSession", request, response},
                   [=, this](const Caller& caller, const Stop&) -> absl::Status {
                     POLYEST_ASSIGN_OR_RETURN(
                         const auto session,
                         FindSession(context_, caller, "name", request->name()));
                     *response = session->Describe();
                     if (request->omit_problem()) return absl::OkStatus();
                     POLYEST_ASSIGN_OR_RETURN(*response->mutable_problem(), session->ReadProblem());
                     return absl::OkStatus();
                   });
}

SessionService::Unary* SessionService::ListSessions(Context* call,
                                                    const v1::ListSessionsRequest* request,
                                                    v1::ListSessionsResponse* response) {
  const auto list = [=, this](const Caller& caller, const Stop&) {
    return Deliver(ListPage(context_.sessions, caller.tenant, *request), response);
  };
  const UnaryCall::Call listing{call, "ListSessions", request, response};
  // Looking into a database that daemons share may wait.
  if (context_.sessions.shared()) return ForCaller(listing, list);
  return StartCall(context_, listing,
                   [&](const Caller& caller) { return JobAtOnce(caller, list); });
}

SessionService::Unary* SessionService::DeleteSession(Context* call,
                                                     const v1::DeleteSessionRequest* request,
                                                     google::protobuf::Empty* response) {
  return ForCaller(
      {call, "DeleteSession", request, response},
      [=, this](const Caller& caller, const Stop&) -> absl::Status {
        POLYEST_RETURN_IF_ERROR(ResourceId("name", "sessions", request->name()).status());
        return context_.sessions.Delete(caller.tenant, request->name());
      });
}

SessionService::Unary* SessionService::AddMeasurements(Context* call,
                                                       const v1::AddMeasurementsRequest* request,
                                                       v1::AddMeasurementsResponse* response) {
  return OnStrand(
      {call, "AddMeasurements", request, response}, request->session(),
      [=, this](const std::shared_ptr<Session>& session, const Stop& stop) -> absl::Status {
        POLYEST_RETURN_IF_ERROR(session->Load(stop));
        POLYEST_ASSIGN_OR_RETURN(*response->mutable_acknowledgement(),
                                 session->Add(request->sequence(), request->measurements()));
        POLYEST_RETURN_IF_ERROR(session->Process(stop));
        if (session->observed()) CatchUp(session, context_.stop);
        return absl::OkStatus();
      });
}

SessionService::Unary* SessionService::GetEstimate(Context* call,
                                                   const v1::GetEstimateRequest* request,
                                                   v1::Estimate* response) {
  return OnStrand({call, "GetEstimate", request, response}, request->session(),
                  [=](const std::shared_ptr<Session>& session, const Stop& stop) -> absl::Status {
                    POLYEST_ASSIGN_OR_RETURN(const SharedEstimate estimate,
                                             session->CurrentEstimate(stop));
                    *response = *estimate;
                    return absl::OkStatus();
                  });
}

}  // namespace

std::unique_ptr<grpc::Service> MakeSessionService(const ServiceContext& context) {
  return std::make_unique<SessionService>(context);
}

}  // namespace polyest::internal
