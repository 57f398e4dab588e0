#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>
#include <vector>

#include "server/service/service_context.h"

namespace polyest::internal {

// Make the services of polyest.v1. They are stateless adapters: each call finds what it works on,
// hands the work to the executor or to a session's strand, and converts the outcome.
std::unique_ptr<grpc::Service> MakeModelService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeProblemService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeSessionService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeStudyService(const ServiceContext& context);
// Makes the service that keeps the operations. Its destructor cancels those under way and waits for
// their ends.
std::unique_ptr<grpc::Service> MakeOperationService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeBackupService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeNodeService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeStatusService(const ServiceContext& context);

// Makes all services. They must be destroyed before what the context refers to.
std::vector<std::unique_ptr<grpc::Service>> MakeServices(const ServiceContext& context);

}  // namespace polyest::internal
