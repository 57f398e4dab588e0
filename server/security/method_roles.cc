#include "server/security/method_roles.h"

#include <absl/strings/str_cat.h>

#include <iterator>
#include <set>

#include "polyest/v1/backup_service.pb.h"
#include "polyest/v1/model_service.pb.h"
#include "polyest/v1/node_service.pb.h"
#include "polyest/v1/operation_service.pb.h"
#include "polyest/v1/problem_service.pb.h"
#include "polyest/v1/session_service.pb.h"
#include "polyest/v1/status_service.pb.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

ServiceDescriptors Services() {
  return {v1::ListModelsRequest::descriptor()->file()->service(0),
          v1::CheckProblemRequest::descriptor()->file()->service(0),
          v1::CreateSessionRequest::descriptor()->file()->service(0),
          v1::ComputeEstimateRequest::descriptor()->file()->service(0),
          v1::StartComputationRequest::descriptor()->file()->service(0),
          v1::DownloadBackupRequest::descriptor()->file()->service(0),
          v1::GetStatusRequest::descriptor()->file()->service(0),
          v1::ListNodesRequest::descriptor()->file()->service(0)};
}

std::string PathOf(Method method) {
  const std::string name(method.name());
  for (const google::protobuf::ServiceDescriptor* const service : Services()) {
    const google::protobuf::MethodDescriptor* const found = service->FindMethodByName(name);
    if (found != nullptr) return PathOf(*found);
  }
  return "";  // not reached, because the services have all methods of the table
}

std::string PathOf(const google::protobuf::MethodDescriptor& method) {
  return absl::StrCat("/", method.service()->full_name(), "/", method.name());
}

bool CoversAllMethods(const ServiceDescriptors& services) {
  std::set<std::string_view> names;
  size_t methods = 0;
  for (const google::protobuf::ServiceDescriptor* const service : services) {
    for (int k = 0; k < service->method_count(); ++k) {
      const std::string_view name = service->method(k)->name();
      if (FindMethodRole(name) == nullptr) return false;
      names.insert(name);
      ++methods;
    }
  }
  return methods == names.size() && methods == std::size(kMethodRoles);
}

}  // namespace polyest::internal
