#include "server/security/method_roles.h"

#include <iterator>

namespace polyest {

bool CoversAllMethods(const google::protobuf::ServiceDescriptor& service) {
  for (int k = 0; k < service.method_count(); ++k) {
    if (FindMethodRole(service.method(k)->name()) == nullptr) return false;
  }
  return static_cast<size_t>(service.method_count()) == std::size(kMethodRoles);
}

}  // namespace polyest
