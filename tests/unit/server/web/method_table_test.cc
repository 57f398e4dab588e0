#include "server/web/method_table.h"

#include <gtest/gtest.h>

#include "server/security/method_roles.h"

namespace polyest::internal {
namespace {

TEST(MethodTable, FindsEveryMethodOfTheContractByItsPath) {
  const MethodTable table(Services());
  int methods = 0;
  for (const google::protobuf::ServiceDescriptor* const service : Services()) {
    for (int i = 0; i < service->method_count(); ++i, ++methods) {
      const std::string path = "/v1/" + service->name() + "/" + service->method(i)->name();
      const WebMethod* const found = table.Find(path);
      ASSERT_NE(found, nullptr) << path;
      EXPECT_EQ(found->method, service->method(i));
      EXPECT_EQ(found->rpc_path,
                "/polyest.v1." + service->name() + "/" + service->method(i)->name());
    }
  }
  EXPECT_GT(methods, 20);
}

TEST(MethodTable, FindsNothingElse) {
  const MethodTable table(Services());
  for (const char* path :
       {"", "/", "/v1", "/v1/", "/v1/SessionService", "/v1/SessionService/",
        "/v1/SessionService/getSession", "/v1/SessionService/GetSession/", "/v1/GetSession",
        "/v2/SessionService/GetSession", "v1/SessionService/GetSession",
        "//v1/SessionService/GetSession", "/v1/polyest.v1.SessionService/GetSession",
        "/v1/Health/Check", "/v1/StudyService/GetSession"}) {
    EXPECT_EQ(table.Find(path), nullptr) << path;
  }
}

}  // namespace
}  // namespace polyest::internal
