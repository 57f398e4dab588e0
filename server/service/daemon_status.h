#pragma once

#include <string>

#include "polyest/v1/status_service.pb.h"
#include "server/service/service_context.h"

namespace polyest::internal {

// Returns the daemon's status, for a caller of the tenant.
v1::DaemonStatus DescribeDaemon(const ServiceContext& context, const std::string& tenant);

}  // namespace polyest::internal
