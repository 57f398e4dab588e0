#include "polyest/v1/status_service.grpc.pb.h"
#include "server/service/calls.h"
#include "server/service/daemon_status.h"
#include "server/service/services.h"

namespace polyest::internal {
namespace {

class StatusService final : public v1::StatusService::CallbackService {
 public:
  explicit StatusService(const ServiceContext& context) : context_(context) {}

  grpc::ServerUnaryReactor* GetStatus(grpc::CallbackServerContext* call,
                                      const v1::GetStatusRequest* request,
                                      v1::DaemonStatus* response) override {
    return StartCall(
        context_, {call, "GetStatus", request, response}, [=, this](const Caller& caller) {
          return ShortJobOfCaller(context_, caller, [=, this](const Caller& known, const Stop&) {
            *response = DescribeDaemon(context_, known.tenant);
            return absl::OkStatus();
          });
        });
  }

 private:
  const ServiceContext context_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeStatusService(const ServiceContext& context) {
  return std::make_unique<StatusService>(context);
}

}  // namespace polyest::internal
