#include "server/security/method_roles.h"

#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include "polyest/v1/estimation_service.pb.h"

namespace polyest {
namespace {

const google::protobuf::FileDescriptor& Contract() {
  return *v1::EstimateRequest::descriptor()->file();
}

TEST(MethodRoles, CoverTheContract) {
  EXPECT_TRUE(CoversAllMethods(*Contract().FindServiceByName("EstimationService")));
}

TEST(MethodRoles, DoNotCoverAnotherService) {
  google::protobuf::FileDescriptorProto file;
  Contract().CopyTo(&file);
  file.set_name("another.proto");
  file.set_package("another");
  google::protobuf::MethodDescriptorProto& method = *file.mutable_service(0)->add_method();
  method = file.service(0).method(0);
  method.set_name("Shutdown");
  google::protobuf::DescriptorPool pool(google::protobuf::DescriptorPool::generated_pool());
  // The messages are of the package polyest.v1, whose names the methods spell out.
  file.clear_message_type();
  file.clear_enum_type();
  file.add_dependency(Contract().name());
  const auto* built = pool.BuildFile(file);
  ASSERT_NE(built, nullptr);
  EXPECT_FALSE(CoversAllMethods(*built->service(0)));
}

TEST(MethodRoles, LetReadersChangeNothing) {
  for (const char* method : {"CreateSession", "AddMeasurements", "StreamMeasurements",
                             "DeleteSession", "ImportSession"}) {
    EXPECT_GT(FindMethodRole(method)->needed, Role::kReader) << method;
  }
  static_assert(Method("ListModels").needed() == Role::kReader);
  EXPECT_EQ(FindMethodRole("listModels"), nullptr);
}

TEST(Caller, KnowsRolesByTheirNames) {
  for (const Role role : {Role::kReader, Role::kWriter, Role::kAdmin}) {
    EXPECT_EQ(ParseRole(RoleName(role)), role);
  }
  for (const char* name : {"", "Reader", "owner", "reader "}) EXPECT_FALSE(ParseRole(name)) << name;
}

}  // namespace
}  // namespace polyest
