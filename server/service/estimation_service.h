#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>

#include "server/service/service_context.h"

namespace polyest {

// polyest.v1.EstimationService as stateless adapters: each call finds what it works on, hands the
// work to the executor, or to a session's strand, and converts the outcome.
std::unique_ptr<grpc::Service> MakeEstimationService(ServiceContext context);

}  // namespace polyest
