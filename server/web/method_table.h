#pragma once

// Finds the method that a path of the HTTP port names.

#include <google/protobuf/descriptor.h>

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace polyest::internal {

struct WebMethod {
  const google::protobuf::MethodDescriptor* method;
  std::string rpc_path;  // "/polyest.v1.SessionService/GetSession"
};

class MethodTable {
 public:
  // Each method of a service has the path /VERSION/Service/Method, where VERSION is the last part
  // of the service's package: /v1/SessionService/GetSession.
  explicit MethodTable(const std::vector<const google::protobuf::ServiceDescriptor*>& services);

  // Returns the method of a path; null if it names none.
  const WebMethod* Find(std::string_view path) const;

 private:
  std::map<std::string, WebMethod, std::less<>> methods_;
};

}  // namespace polyest::internal
