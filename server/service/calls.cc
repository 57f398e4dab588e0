#include "server/service/calls.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "core/common/status.h"
#include "proto/wire/operations/names.h"
#include "server/execution/guarded.h"

namespace polyest::internal {
namespace {

UnaryCall::Work WorkOfCaller(const Caller& caller, CallerWork work) {
  return [caller, work = std::move(work)](const Stop& stop, std::stop_source&,
                                          const UnaryCall::Finisher& finish) {
    finish(work(caller, stop));
    return absl::OkStatus();
  };
}

Job JobInLane(const ServiceContext& context, const Caller& caller, const char* lane,
              CallerWork work) {
  return {[&executor = context.executor, lane = absl::StrCat(caller.tenant, lane)](Task task) {
            return executor.Submit(lane, std::move(task));
          },
          WorkOfCaller(caller, std::move(work))};
}

using FoundSession = absl::StatusOr<std::shared_ptr<Session>>;

// Looks for the session on the executor, because that waits, and then submits the task to its
// strand. Where there is none to submit it to, the task runs at once and tells why.
absl::Status SubmitWhenFound(const ServiceContext& context, const Caller& caller,
                             const std::string& name, const std::shared_ptr<FoundSession>& found,
                             Task task) {
  const auto look = [&context, caller, name, found, task = std::move(task)] {
    const absl::Status accepted = Guarded([&]() -> absl::Status {
      POLYEST_ASSIGN_OR_RETURN(*found, context.sessions.Find(caller.tenant, name));
      return (**found)->strand().Submit(task);
    });
    if (accepted.ok()) return;
    *found = accepted;
    task();
  };
  return context.executor.Submit(absl::StrCat(caller.tenant, "/sessions"), look);
}

}  // namespace

absl::StatusOr<std::shared_ptr<Session>> FindSession(const ServiceContext& context,
                                                     const Caller& caller, const std::string& field,
                                                     const std::string& name) {
  POLYEST_RETURN_IF_ERROR(ResourceId(field, "sessions", name).status());
  return context.sessions.Find(caller.tenant, name);
}

Job JobOfCaller(const ServiceContext& context, const Caller& caller, CallerWork work) {
  return JobInLane(context, caller, "/calls", std::move(work));
}

Job ShortJobOfCaller(const ServiceContext& context, const Caller& caller, CallerWork work) {
  return JobInLane(context, caller, "/sessions", std::move(work));
}

Job JobAtOnce(const Caller& caller, CallerWork work) {
  return {[](const Task& task) {
            task();
            return absl::OkStatus();
          },
          WorkOfCaller(caller, std::move(work))};
}

absl::StatusOr<Job> JobOfSession(const ServiceContext& context, const Caller& caller,
                                 const std::string& field, const std::string& name,
                                 SessionWork work) {
  POLYEST_RETURN_IF_ERROR(ResourceId(field, "sessions", name).status());
  const auto found = std::make_shared<FoundSession>();
  if (!context.sessions.shared()) {
    POLYEST_ASSIGN_OR_RETURN(*found, context.sessions.Get(caller.tenant, name));
  }
  const auto submit = [&context, caller, name, found](Task task) {
    if (found->ok()) return (**found)->strand().Submit(std::move(task));
    return SubmitWhenFound(context, caller, name, found, std::move(task));
  };
  return Job{submit,
             [found, work = std::move(work)](const Stop& stop, std::stop_source& source,
                                             UnaryCall::Finisher finish) -> absl::Status {
               POLYEST_ASSIGN_OR_RETURN(const std::shared_ptr<Session> session, *found);
               const uint64_t losses = session->losses();
               const std::stop_callback closing(session->closing(),
                                                [&source] { source.request_stop(); });
               const absl::Status done = work(session, stop);
               POLYEST_RETURN_IF_ERROR(session->CheckOpen());
               POLYEST_RETURN_IF_ERROR(done);
               session->WhenAllKept(losses, std::move(finish));
               return absl::OkStatus();
             }};
}

grpc::ServerUnaryReactor* StartCall(
    const ServiceContext& context, const UnaryCall::Call& call,
    const std::function<absl::StatusOr<Job>(const Caller&)>& make_job) {
  const auto caller = context.access.Authorize(*call.context, call.method);
  if (!caller.ok()) return FinishAtOnce(call.context, caller.status());
  auto job = make_job(*caller);
  if (!job.ok()) return FinishAtOnce(call.context, job.status());
  return UnaryCall::Start(context, caller->tenant, call, std::move(job->submit),
                          std::move(job->work));
}

}  // namespace polyest::internal
