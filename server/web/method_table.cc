#include "server/web/method_table.h"

#include <absl/strings/str_cat.h>

#include "server/security/method_roles.h"

namespace polyest::internal {

MethodTable::MethodTable(const std::vector<const google::protobuf::ServiceDescriptor*>& services) {
  for (const google::protobuf::ServiceDescriptor* const service : services) {
    const std::string& package = service->file()->package();
    const std::string prefix =
        absl::StrCat("/", package.substr(package.rfind('.') + 1), "/", service->name(), "/");
    for (int i = 0; i < service->method_count(); ++i) {
      const google::protobuf::MethodDescriptor* const method = service->method(i);
      methods_.emplace(absl::StrCat(prefix, method->name()), WebMethod{method, PathOf(*method)});
    }
  }
}

const WebMethod* MethodTable::Find(std::string_view path) const {
  const auto found = methods_.find(path);
  return found == methods_.end() ? nullptr : &found->second;
}

}  // namespace polyest::internal
