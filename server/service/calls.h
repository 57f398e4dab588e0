#pragma once

// Runs the unary calls of all services. Each call finds what it works on, hands the work to the
// executor or to a session's strand, and is finished with the outcome.

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <string>

#include "server/service/service_context.h"
#include "server/service/unary_call.h"

namespace polyest::internal {

// Describes work and where it runs.
struct Job {
  UnaryCall::Submit submit;
  UnaryCall::Work work;
};

using CallerWork = std::function<absl::Status(const Caller&, const Stop&)>;
using SessionWork = std::function<absl::Status(const std::shared_ptr<Session>&, const Stop&)>;

// Returns the caller's session of this name; waits for a journal that daemons share. NOT_FOUND when
// there is none; INVALID_ARGUMENT, naming `field`, when `name` is no name of a session;
// UNAVAILABLE, naming the owner, when it belongs to another daemon.
absl::StatusOr<std::shared_ptr<Session>> FindSession(const ServiceContext& context,
                                                     const Caller& caller, const std::string& field,
                                                     const std::string& name);

// Returns a job for work that may take long, in the lane of the caller's requests.
Job JobOfCaller(const ServiceContext& context, const Caller& caller, CallerWork work);
// Returns a job for work that is soon done, in the lane of the caller's sessions, where it does not
// wait for long requests.
Job ShortJobOfCaller(const ServiceContext& context, const Caller& caller, CallerWork work);
// Returns a job for work that is done at once and waits for nothing, by gRPC's own thread.
Job JobAtOnce(const Caller& caller, CallerWork work);
// Returns a job that finds the caller's session, as FindSession does, and runs on its strand. The
// call is finished when everything is kept that the work may have seen, and soon with NOT_FOUND
// when the session is deleted meanwhile.
absl::StatusOr<Job> JobOfSession(const ServiceContext& context, const Caller& caller,
                                 const std::string& field, const std::string& name,
                                 SessionWork work);

// Starts a unary call with the job that is made for its caller and fills the answer. A caller who
// may not call the method is refused before anything else.
grpc::ServerUnaryReactor* StartCall(
    const ServiceContext& context, const UnaryCall::Call& call,
    const std::function<absl::StatusOr<Job>(const Caller&)>& make_job);

}  // namespace polyest::internal
