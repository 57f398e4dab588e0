#include "server/service/estimation_service.h"

#include <functional>
#include <utility>

#include "core/common/status.h"
#include "polyest/v1/estimation_service.grpc.pb.h"
#include "server/convert/annotate.h"
#include "server/operations/names.h"
#include "server/operations/operations.h"
#include "server/operations/pages.h"
#include "server/service/catch_up.h"
#include "server/service/daemon_status.h"
#include "server/service/export_call.h"
#include "server/service/guarded.h"
#include "server/service/import_call.h"
#include "server/service/measurement_stream.h"
#include "server/service/session_watch.h"
#include "server/service/unary_call.h"

namespace polyest {
namespace {

// Propagations of one call run on the call's own thread: the executor's threads serve the calls.
constexpr int kThreadsPerCall = 1;

absl::StatusOr<std::shared_ptr<Session>> FindSession(const SessionRegistry& sessions,
                                                     const std::string& tenant,
                                                     const std::string& field,
                                                     const std::string& name) {
  POLYEST_RETURN_IF_ERROR(ResourceId(field, "sessions", name).status());
  return sessions.Get(tenant, name);
}

absl::StatusOr<v1::ListSessionsResponse> ListPage(const SessionRegistry& sessions,
                                                  const std::string& tenant,
                                                  const v1::ListSessionsRequest& request) {
  POLYEST_ASSIGN_OR_RETURN(const size_t page_size, PageSize(request.page_size()));
  if (!request.page_token().empty() &&
      !ResourceId("pageToken", "sessions", request.page_token()).ok()) {
    return UnknownPageToken(request.page_token());
  }
  // One more than asked for tells whether there is another page.
  auto page = sessions.List(tenant, request.page_token(), page_size + 1);
  v1::ListSessionsResponse response;
  if (page.size() > page_size) {
    page.pop_back();
    response.set_next_page_token(page.back()->name());
  }
  for (const auto& session : page) *response.add_sessions() = session->Describe();
  return response;
}

absl::Status SessionAndProblem(const std::string& session) {
  return absl::InvalidArgumentError(
      absl::StrCat("session: \"", session, "\" is given and a problem too: a session has its own"));
}

class EstimationService final : public v1::EstimationService::CallbackService {
 public:
  explicit EstimationService(ServiceContext context) : context_(std::move(context)) {}

  using Unary = grpc::ServerUnaryReactor;
  using Context = grpc::CallbackServerContext;

  Unary* ListModels(Context* context, const v1::ListModelsRequest* request,
                    v1::ListModelsResponse* response) override;
  Unary* GetModel(Context* context, const v1::GetModelRequest* request,
                  v1::Model* response) override;

  Unary* Estimate(Context* context, const v1::EstimateRequest* request,
                  v1::EstimateResponse* response) override;
  Unary* Propagate(Context* context, const v1::PropagateRequest* request,
                   v1::PropagateResponse* response) override;
  Unary* EvaluateCost(Context* context, const v1::EvaluateCostRequest* request,
                      v1::EvaluateCostResponse* response) override;
  Unary* AnalyzeSensitivity(Context* context, const v1::AnalyzeSensitivityRequest* request,
                            v1::AnalyzeSensitivityResponse* response) override;
  Unary* DesignExperiment(Context* context, const v1::DesignExperimentRequest* request,
                          v1::DesignExperimentResponse* response) override;

  Unary* CreateSession(Context* context, const v1::CreateSessionRequest* request,
                       v1::Session* response) override;
  Unary* GetSession(Context* context, const v1::GetSessionRequest* request,
                    v1::Session* response) override;
  Unary* ListSessions(Context* context, const v1::ListSessionsRequest* request,
                      v1::ListSessionsResponse* response) override;
  Unary* DeleteSession(Context* context, const v1::DeleteSessionRequest* request,
                       google::protobuf::Empty* response) override;
  Unary* GetStatus(Context* context, const v1::GetStatusRequest* request,
                   v1::DaemonStatus* response) override;

  grpc::ServerWriteReactor<v1::SessionRecord>* ExportSession(
      Context* context, const v1::ExportSessionRequest* request) override {
    return new ExportCall(context_, *context, request->name());
  }
  grpc::ServerReadReactor<v1::ImportSessionRequest>* ImportSession(Context* context,
                                                                   v1::Session* response) override {
    return new ImportCall(context_, *context, response);
  }

  Unary* AddMeasurements(Context* context, const v1::AddMeasurementsRequest* request,
                         v1::AddMeasurementsResponse* response) override;
  Unary* GetEstimate(Context* context, const v1::GetEstimateRequest* request,
                     v1::EstimateResponse* response) override;
  grpc::ServerBidiReactor<v1::StreamMeasurementsRequest, v1::StreamMeasurementsResponse>*
  StreamMeasurements(Context* context) override;
  grpc::ServerWriteReactor<v1::EstimateResponse>* WatchSession(
      Context* context, const v1::WatchSessionRequest* request) override;

  Unary* GetPosterior(Context* context, const v1::GetPosteriorRequest* request,
                      v1::GetPosteriorResponse* response) override;
  Unary* ProfileCost(Context* context, const v1::ProfileCostRequest* request,
                     v1::ProfileCostResponse* response) override;
  Unary* SweepRegularization(Context* context, const v1::SweepRegularizationRequest* request,
                             v1::SweepRegularizationResponse* response) override;

 private:
  using Work = std::function<absl::Status(const Stop&)>;
  using CallerWork = std::function<absl::Status(const Caller&, const Stop&)>;
  template <typename Request, typename Response>
  using Operation = absl::StatusOr<Response> (*)(const Request&, int threads, const Stop&,
                                                 const ModelLibrary&, const ProblemLimits&);
  using SessionWork = std::function<absl::Status(const std::shared_ptr<Session>&, const Stop&)>;

  // All of these refuse a caller who may not call the method, before anything else.
  Unary* OnExecutor(Context* context, Method method, Work work);
  // An operation that needs no session, within the limits.
  template <typename Request, typename Response>
  Unary* Compute(Context* context, Method method, Operation<Request, Response> operation,
                 const Request* request, Response* response);
  // The same of the request's problem, or of its session.
  template <typename Request, typename Response>
  Unary* Study(Context* context, Method method, Operation<Request, Response> operation,
               absl::StatusOr<Response> (Session::*of_session)(const Request&, const Stop&),
               const Request* request, Response* response);
  // What is soon done, in the lane of the caller's sessions: it does not wait for long requests.
  Unary* ForCaller(Context* context, Method method, CallerWork work);
  Unary* InLane(const char* lane, Context* context, Method method, CallerWork work);
  // The session is `field` of the request; its work runs on its strand, and the call is finished
  // when everything is kept that the work may have seen.
  Unary* OnStrand(Context* context, Method method, const std::string& field,
                  const std::string& session, SessionWork work);

  ServiceContext context_;
};

EstimationService::Unary* EstimationService::OnExecutor(Context* context, Method method,
                                                        Work work) {
  return InLane("/calls", context, method,
                [work = std::move(work)](const Caller&, const Stop& stop) { return work(stop); });
}

template <typename Request, typename Response>
EstimationService::Unary* EstimationService::Compute(Context* context, Method method,
                                                     Operation<Request, Response> operation,
                                                     const Request* request, Response* response) {
  return OnExecutor(context, method, [=, this](const Stop& stop) -> absl::Status {
    const SessionServices& services = context_.sessions.services();
    POLYEST_RETURN_IF_ERROR(services.memory.Check());
    return Deliver(
        operation(*request, kThreadsPerCall, stop, context_.models, services.limits.problem),
        response);
  });
}

EstimationService::Unary* EstimationService::ForCaller(Context* context, Method method,
                                                       CallerWork work) {
  return InLane("/sessions", context, method, std::move(work));
}

EstimationService::Unary* EstimationService::InLane(const char* lane, Context* context,
                                                    Method method, CallerWork work) {
  const auto caller = context_.access.Authorize(*context, method);
  if (!caller.ok()) return FinishAtOnce(context, caller.status());
  return UnaryCall::Start(
      context_, context,
      [&](Task task) {
        return context_.executor.Submit(absl::StrCat(caller->tenant, lane), std::move(task));
      },
      [caller = *caller, work = std::move(work)](const Stop& stop,
                                                 const UnaryCall::Finisher& finish) {
        finish(work(caller, stop));
        return absl::OkStatus();
      });
}

EstimationService::Unary* EstimationService::OnStrand(Context* context, Method method,
                                                      const std::string& field,
                                                      const std::string& session,
                                                      SessionWork work) {
  const auto caller = context_.access.Authorize(*context, method);
  if (!caller.ok()) return FinishAtOnce(context, caller.status());
  auto found = FindSession(context_.sessions, caller->tenant, field, session);
  if (!found.ok()) return FinishAtOnce(context, found.status());
  return UnaryCall::Start(
      context_, context,
      [found = *found](Task task) { return found->strand().Submit(std::move(task)); },
      [found = *found, work = std::move(work)](const Stop& stop,
                                               UnaryCall::Finisher finish) -> absl::Status {
        const uint64_t losses = found->losses();
        POLYEST_RETURN_IF_ERROR(work(found, stop));
        found->WhenAllKept(losses, std::move(finish));
        return absl::OkStatus();
      });
}

template <typename Request, typename Response>
EstimationService::Unary* EstimationService::Study(
    Context* context, Method method, Operation<Request, Response> operation,
    absl::StatusOr<Response> (Session::*of_session)(const Request&, const Stop&),
    const Request* request, Response* response) {
  if (request->session().empty()) return Compute(context, method, operation, request, response);
  if (request->has_problem() || request->has_measurements()) {
    return OnExecutor(context, method,
                      [=](const Stop&) { return SessionAndProblem(request->session()); });
  }
  return OnStrand(context, method, "session", request->session(),
                  [=](const std::shared_ptr<Session>& session, const Stop& stop) {
                    return Deliver((session.get()->*of_session)(*request, stop), response);
                  });
}

EstimationService::Unary* EstimationService::ListModels(Context* context,
                                                        const v1::ListModelsRequest* request,
                                                        v1::ListModelsResponse* response) {
  // A folder of FMUs may have to be read.
  return OnExecutor(context, "ListModels", [=, this](const Stop&) {
    return Deliver(polyest::ListModels(*request, context_.models), response);
  });
}

EstimationService::Unary* EstimationService::GetModel(Context* context,
                                                      const v1::GetModelRequest* request,
                                                      v1::Model* response) {
  return OnExecutor(context, "GetModel", [=, this](const Stop&) {
    return Deliver(polyest::GetModel(*request, context_.models), response);
  });
}

EstimationService::Unary* EstimationService::Estimate(Context* context,
                                                      const v1::EstimateRequest* request,
                                                      v1::EstimateResponse* response) {
  return Compute(context, "Estimate", RunEstimate, request, response);
}

EstimationService::Unary* EstimationService::Propagate(Context* context,
                                                       const v1::PropagateRequest* request,
                                                       v1::PropagateResponse* response) {
  return Compute(context, "Propagate", RunPropagate, request, response);
}

EstimationService::Unary* EstimationService::EvaluateCost(Context* context,
                                                          const v1::EvaluateCostRequest* request,
                                                          v1::EvaluateCostResponse* response) {
  return Compute(context, "EvaluateCost", RunEvaluateCost, request, response);
}

EstimationService::Unary* EstimationService::AnalyzeSensitivity(
    Context* context, const v1::AnalyzeSensitivityRequest* request,
    v1::AnalyzeSensitivityResponse* response) {
  return Compute(context, "AnalyzeSensitivity", RunAnalyzeSensitivity, request, response);
}

EstimationService::Unary* EstimationService::DesignExperiment(
    Context* context, const v1::DesignExperimentRequest* request,
    v1::DesignExperimentResponse* response) {
  return Compute(context, "DesignExperiment", RunDesignExperiment, request, response);
}

EstimationService::Unary* EstimationService::CreateSession(Context* context,
                                                           const v1::CreateSessionRequest* request,
                                                           v1::Session* response) {
  return ForCaller(
      context, "CreateSession", [=, this](const Caller& caller, const Stop&) -> absl::Status {
        POLYEST_ASSIGN_OR_RETURN(
            const auto session,
            context_.sessions.Create(caller.tenant, request->session_id(), request->problem()));
        *response = session->Describe();
        *response->mutable_problem() = request->problem();
        return absl::OkStatus();
      });
}

EstimationService::Unary* EstimationService::GetSession(Context* context,
                                                        const v1::GetSessionRequest* request,
                                                        v1::Session* response) {
  return ForCaller(
      context, "GetSession", [=, this](const Caller& caller, const Stop&) -> absl::Status {
        POLYEST_ASSIGN_OR_RETURN(const auto session, FindSession(context_.sessions, caller.tenant,
                                                                 "name", request->name()));
        *response = session->Describe();
        POLYEST_ASSIGN_OR_RETURN(*response->mutable_problem(), session->ReadProblem());
        return absl::OkStatus();
      });
}

EstimationService::Unary* EstimationService::ListSessions(Context* context,
                                                          const v1::ListSessionsRequest* request,
                                                          v1::ListSessionsResponse* response) {
  const auto caller = context_.access.Authorize(*context, "ListSessions");
  if (!caller.ok()) return FinishAtOnce(context, caller.status());
  return FinishAtOnce(context,
                      Deliver(ListPage(context_.sessions, caller->tenant, *request), response));
}

EstimationService::Unary* EstimationService::DeleteSession(Context* context,
                                                           const v1::DeleteSessionRequest* request,
                                                           google::protobuf::Empty*) {
  return ForCaller(
      context, "DeleteSession", [=, this](const Caller& caller, const Stop&) -> absl::Status {
        POLYEST_RETURN_IF_ERROR(ResourceId("name", "sessions", request->name()).status());
        return context_.sessions.Delete(caller.tenant, request->name());
      });
}

EstimationService::Unary* EstimationService::GetStatus(Context* context,
                                                       const v1::GetStatusRequest*,
                                                       v1::DaemonStatus* response) {
  return ForCaller(context, "GetStatus", [=, this](const Caller& caller, const Stop&) {
    *response = DescribeDaemon(context_, caller.tenant);
    return absl::OkStatus();
  });
}

EstimationService::Unary* EstimationService::AddMeasurements(
    Context* context, const v1::AddMeasurementsRequest* request,
    v1::AddMeasurementsResponse* response) {
  return OnStrand(
      context, "AddMeasurements", "session", request->session(),
      [=, this](const std::shared_ptr<Session>& session, const Stop& stop) -> absl::Status {
        POLYEST_RETURN_IF_ERROR(session->Load(stop));
        POLYEST_ASSIGN_OR_RETURN(*response->mutable_acknowledgement(),
                                 session->Add(request->sequence(), request->measurements()));
        POLYEST_RETURN_IF_ERROR(session->Process(stop));
        if (session->observed()) CatchUp(session, context_.stop);
        return absl::OkStatus();
      });
}

EstimationService::Unary* EstimationService::GetEstimate(Context* context,
                                                         const v1::GetEstimateRequest* request,
                                                         v1::EstimateResponse* response) {
  return OnStrand(context, "GetEstimate", "session", request->session(),
                  [=](const std::shared_ptr<Session>& session, const Stop& stop) -> absl::Status {
                    POLYEST_ASSIGN_OR_RETURN(const SharedEstimate estimate,
                                             session->CurrentEstimate(stop));
                    *response->mutable_estimate() = *estimate;
                    return absl::OkStatus();
                  });
}

grpc::ServerBidiReactor<v1::StreamMeasurementsRequest, v1::StreamMeasurementsResponse>*
EstimationService::StreamMeasurements(Context* context) {
  return new MeasurementStream(context_, *context);
}

grpc::ServerWriteReactor<v1::EstimateResponse>* EstimationService::WatchSession(
    Context* context, const v1::WatchSessionRequest* request) {
  return new SessionWatch(context_, *context, request->session());
}

EstimationService::Unary* EstimationService::GetPosterior(Context* context,
                                                          const v1::GetPosteriorRequest* request,
                                                          v1::GetPosteriorResponse* response) {
  return Study(context, "GetPosterior", RunGetPosterior, &Session::CurrentPosterior, request,
               response);
}

EstimationService::Unary* EstimationService::ProfileCost(Context* context,
                                                         const v1::ProfileCostRequest* request,
                                                         v1::ProfileCostResponse* response) {
  return Study(context, "ProfileCost", RunProfileCost, &Session::CurrentProfiles, request,
               response);
}

EstimationService::Unary* EstimationService::SweepRegularization(
    Context* context, const v1::SweepRegularizationRequest* request,
    v1::SweepRegularizationResponse* response) {
  return Study(context, "SweepRegularization", RunSweepRegularization,
               &Session::CurrentRegularizationSweep, request, response);
}

}  // namespace

std::unique_ptr<grpc::Service> MakeEstimationService(ServiceContext context) {
  return std::make_unique<EstimationService>(std::move(context));
}

}  // namespace polyest
