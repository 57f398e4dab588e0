#include "server/security/method_roles.h"

#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(MethodRoles, CoverTheContract) { EXPECT_TRUE(CoversAllMethods(Services())); }

TEST(MethodRoles, DoNotCoverAnotherService) {
  google::protobuf::FileDescriptorProto file;
  file.set_name("another.proto");
  file.set_package("another");
  file.set_syntax("proto3");
  file.add_dependency("polyest/v1/status_service.proto");
  auto& service = *file.add_service();
  service.set_name("Another");
  auto& method = *service.add_method();
  method.set_name("Shutdown");
  method.set_input_type(".polyest.v1.GetStatusRequest");
  method.set_output_type(".polyest.v1.DaemonStatus");
  google::protobuf::DescriptorPool pool(google::protobuf::DescriptorPool::generated_pool());
  const auto* const built = pool.BuildFile(file);
  ASSERT_NE(built, nullptr);
  ServiceDescriptors services = Services();
  services.push_back(built->service(0));
  EXPECT_FALSE(CoversAllMethods(services));
}

TEST(MethodRoles, DoNotCoverTwoMethodsOfOneName) {
  ServiceDescriptors services = Services();
  services.push_back(services.front());
  EXPECT_FALSE(CoversAllMethods(services));
  services = Services();
  services.pop_back();
  EXPECT_FALSE(CoversAllMethods(services));
}

TEST(MethodRoles, LetReadersChangeNothing) {
  for (const char* method : {"CreateSession", "AddMeasurements", "StreamMeasurements",
                             "DeleteSession", "ImportSession"}) {
    EXPECT_GT(FindMethodRole(method)->needed, Role::kReader) << method;
  }
  static_assert(Method("ListModels").needed() == Role::kReader);
  EXPECT_EQ(FindMethodRole("listModels"), nullptr);
}

TEST(MethodRoles, LetAdminsOfATenantReadNoOtherTenants) {
  static_assert(Method("DownloadBackup").needed() == Role::kOperator);
  EXPECT_LT(Role::kAdmin, Role::kOperator);
}

TEST(Caller, KnowsRolesByTheirNames) {
  for (const Role role : {Role::kReader, Role::kWriter, Role::kAdmin, Role::kOperator}) {
    EXPECT_EQ(ParseRole(RoleName(role)), role);
  }
  for (const char* name : {"", "Reader", "owner", "reader "}) EXPECT_FALSE(ParseRole(name)) << name;
}

}  // namespace
}  // namespace polyest::internal
