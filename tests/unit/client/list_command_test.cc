#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <memory>
#include <sstream>

#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "polyest/v1/session_service.grpc.pb.h"

namespace polyest::internal::list_command_test {
namespace {

using ::testing::HasSubstr;

// Plays a daemon with one session, created long after the last time that JSON has.
class FarFuture final : public v1::SessionService::Service {
 public:
  grpc::Status ListSessions(grpc::ServerContext* /*context*/,
                            const v1::ListSessionsRequest* /*request*/,
                            v1::ListSessionsResponse* list) override {
    v1::Session& session = *list->add_sessions();
    session.set_name("sessions/rig");
    session.mutable_create_time()->set_seconds(1'000'000'000'000'000);
    return grpc::Status::OK;
  }
};

TEST(ListCommand, ReportsATimeThatJsonDoesNotAllowAndPrintsTheTableAllTheSame) {
  FarFuture daemon;
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&daemon);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  ListArguments arguments;
  arguments.place.server = absl::StrCat("127.0.0.1:", port);
  std::ostringstream out, err;
  arguments.format = Format::kJson;
  EXPECT_EQ(RunCommand(arguments, out, err), kExitFailure);
  EXPECT_EQ(out.str(), "");
  EXPECT_THAT(err.str(), HasSubstr("createTime"));
  arguments.format = Format::kTable;
  EXPECT_EQ(RunCommand(arguments, out, err), kExitOk);
  EXPECT_THAT(out.str(), HasSubstr("rig"));
}

}  // namespace
}  // namespace polyest::internal::list_command_test
