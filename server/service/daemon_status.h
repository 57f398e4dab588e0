#pragma once

#include <string>

#include "polyest/v1/status_service.pb.h"
#include "server/service/service_context.h"

namespace polyest::internal {

// How the daemon is, for a caller of that tenant.
v1::DaemonStatus DescribeDaemon(const ServiceContext& context, const std::string& tenant);

}  // namespace polyest::internal
