#pragma once

#include <string>

#include "polyest/v1/estimation_service.pb.h"
#include "server/service/service_context.h"

namespace polyest {

// How the daemon is, for a caller of that tenant.
v1::DaemonStatus DescribeDaemon(const ServiceContext& context, const std::string& tenant);

}  // namespace polyest
