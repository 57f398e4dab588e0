#include "server/service/calls.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "core/common/status.h"
#include "proto/wire/operations/names.h"

namespace polyest::internal {
namespace {

Job JobInLane(const ServiceContext& context, const Caller& caller, const char* lane,
              CallerWork work) {
  return {[&executor = context.executor, lane = absl::StrCat(caller.tenant, lane)](Task task) {
            return executor.Submit(lane, std::move(task));
          },
          [caller, work = std::move(work)](const Stop& stop, const UnaryCall::Finisher& finish) {
            finish(work(caller, stop));
            return absl::OkStatus();
          }};
}

}  // namespace

absl::StatusOr<std::shared_ptr<Session>> FindSession(const ServiceContext& context,
                                                     const Caller& caller, const std::string& field,
                                                     const std::string& name) {
  POLYEST_RETURN_IF_ERROR(ResourceId(field, "sessions", name).status());
  return context.sessions.Get(caller.tenant, name);
}

Job JobOfCaller(const ServiceContext& context, const Caller& caller, CallerWork work) {
  return JobInLane(context, caller, "/calls", std::move(work));
}

Job ShortJobOfCaller(const ServiceContext& context, const Caller& caller, CallerWork work) {
  return JobInLane(context, caller, "/sessions", std::move(work));
}

Job JobOfSession(std::shared_ptr<Session> session, SessionWork work) {
  return {[session](Task task) { return session->strand().Submit(std::move(task)); },
          [session, work = std::move(work)](const Stop& stop,
                                            UnaryCall::Finisher finish) -> absl::Status {
            const uint64_t losses = session->losses();
            POLYEST_RETURN_IF_ERROR(work(session, stop));
            session->WhenAllKept(losses, std::move(finish));
            return absl::OkStatus();
          }};
}

grpc::ServerUnaryReactor* StartCall(
    const ServiceContext& context, grpc::CallbackServerContext* call, Method method,
    const google::protobuf::Message* answer,
    const std::function<absl::StatusOr<Job>(const Caller&)>& make_job) {
  const auto caller = context.access.Authorize(*call, method);
  if (!caller.ok()) return FinishAtOnce(call, caller.status());
  auto job = make_job(*caller);
  if (!job.ok()) return FinishAtOnce(call, job.status());
  return UnaryCall::Start(context, caller->tenant, call, answer, job->submit, std::move(job->work));
}

}  // namespace polyest::internal
