#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>
#include <vector>

#include "server/service/service_context.h"

namespace polyest::internal {

// The services of polyest.v1 as stateless adapters: each call finds what it works on, hands the
// work to the executor, or to a session's strand, and converts the outcome.
std::unique_ptr<grpc::Service> MakeModelService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeProblemService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeSessionService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeStudyService(const ServiceContext& context);
// Keeps the operations; waits for those under way when it goes.
std::unique_ptr<grpc::Service> MakeOperationService(const ServiceContext& context);
std::unique_ptr<grpc::Service> MakeStatusService(const ServiceContext& context);

// All of them. They end before what the context refers to.
std::vector<std::unique_ptr<grpc::Service>> MakeServices(const ServiceContext& context);

}  // namespace polyest::internal
