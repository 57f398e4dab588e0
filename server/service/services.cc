#include "server/service/services.h"

namespace polyest::internal {

std::vector<std::unique_ptr<grpc::Service>> MakeServices(const ServiceContext& context) {
  std::vector<std::unique_ptr<grpc::Service>> services;
  for (const auto make :
       {MakeModelService, MakeProblemService, MakeSessionService, MakeStudyService,
        MakeOperationService, MakeBackupService, MakeNodeService, MakeStatusService}) {
    services.push_back(make(context));
  }
  return services;
}

}  // namespace polyest::internal
