#include "polyest/v1/problem_service.grpc.pb.h"
#include "proto/problem_schema.h"
#include "proto/wire/check/check.h"
#include "server/service/calls.h"
#include "server/service/services.h"

namespace polyest::internal {
namespace {

class ProblemService final : public v1::ProblemService::CallbackService {
 public:
  using Unary = grpc::ServerUnaryReactor;
  using Context = grpc::CallbackServerContext;

  explicit ProblemService(const ServiceContext& context) : context_(context) {}

  Unary* CheckProblem(Context* call, const v1::CheckProblemRequest* request,
                      v1::CheckProblemResponse* response) override {
    return StartCall(
        context_, {call, "CheckProblem", request, response}, [=, this](const Caller& caller) {
          return JobOfCaller(context_, caller, [=, this](const Caller&, const Stop&) {
            const SessionServices& services = context_.sessions.services();
            const absl::Status room = services.memory.Check();
            if (!room.ok()) return room;
            *response =
                polyest::internal::CheckProblem(*request, context_.models, services.limits.problem);
            return absl::OkStatus();
          });
        });
  }

  Unary* GetProblemSchema(Context* call, const v1::GetProblemSchemaRequest* request,
                          v1::GetProblemSchemaResponse* response) override {
    return StartCall(context_, {call, "GetProblemSchema", request, response},
                     [=, this](const Caller& caller) {
                       return ShortJobOfCaller(context_, caller, [=](const Caller&, const Stop&) {
                         response->set_json_schema(kProblemSchema);
                         return absl::OkStatus();
                       });
                     });
  }

 private:
  const ServiceContext context_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeProblemService(const ServiceContext& context) {
  return std::make_unique<ProblemService>(context);
}

}  // namespace polyest::internal
