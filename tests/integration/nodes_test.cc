// Tests what daemons of one database tell of each other, and how one hands its sessions over.

#include <signal.h>

#include "polyest/rpc/error_details.pb.h"
#include "polyest/v1/node_service.grpc.pb.h"
#include "tests/integration/postgres_fixture.h"

namespace polyest::internal {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

class NodesTest : public PostgresTest {
 protected:
  std::vector<std::string> Sharing() const {
    std::vector<std::string> arguments = Arguments();
    arguments.insert(arguments.end(), {"--node-secret", secret_});
    return arguments;
  }
  static v1::ListNodesResponse Nodes(Node& node, const v1::ListNodesRequest& request = {}) {
    grpc::ClientContext context;
    v1::ListNodesResponse response;
    const auto stub = v1::NodeService::NewStub(node.channel());
    const grpc::Status listed = stub->ListNodes(&context, request, &response);
    EXPECT_TRUE(listed.ok()) << listed.error_message();
    return response;
  }
  // Returns how the daemon at an address is told of.
  static v1::Node Told(Node& node, const std::string& address) {
    const v1::ListNodesResponse list = Nodes(node);
    for (const v1::Node& one : list.nodes()) {
      if (one.address() == address) return one;
    }
    return {};
  }
  static grpc::Status Drain(Node& node, const std::string& name) {
    grpc::ClientContext context;
    v1::DrainNodeRequest request;
    request.set_name(name);
    v1::DrainNodeResponse drained;
    return v1::NodeService::NewStub(node.channel())->DrainNode(&context, request, &drained);
  }

  const TestFolder folder_;
  const std::string secret_ = folder_.Write("node.secret", std::string(32, 's'));
};

TEST_F(NodesTest, TellsWhatEachDaemonHas) {
  Node first(Sharing()), second(Sharing());
  ASSERT_TRUE(first.Create("rig").ok());
  ClientStream stream(second.sessions());
  ASSERT_TRUE(stream.Send("sessions/rig", 1, BatchOf(1)));
  stream.ExpectAcknowledgement(1);
  while (Told(second, first.address()).stream_count() != 1) continue;
  const v1::Node told = Told(first, first.address());
  EXPECT_EQ(told.session_count(), 1);
  EXPECT_EQ(Told(first, second.address()).session_count(), 0);
  EXPECT_FALSE(told.draining());
  EXPECT_GE(told.busy_core_count(), 0);
  EXPECT_GE(told.lease_age_s(), 0);
  const v1::ListNodesResponse all = Nodes(second);
  ASSERT_EQ(all.nodes_size(), 2);
  EXPECT_EQ(all.next_page_token(), "");
  v1::ListNodesRequest page;
  page.set_page_size(1);
  for (const v1::Node& one : all.nodes()) {
    const v1::ListNodesResponse answer = Nodes(second, page);
    ASSERT_EQ(answer.nodes_size(), 1);
    EXPECT_EQ(answer.nodes(0).name(), one.name());
    page.set_page_token(answer.next_page_token());
  }
  EXPECT_EQ(page.page_token(), "");
}

TEST_F(NodesTest, RefusesToDrainWhereNobodyWouldTakeTheSessions) {
  Node only(Sharing()), memory({"--durability", "memory"});
  const grpc::Status alone = Drain(only, Nodes(only).nodes(0).name());
  EXPECT_EQ(alone.error_code(), StatusCode::FAILED_PRECONDITION) << alone.error_message();
  Node other(Sharing());
  while (Told(only, other.address()).name().empty()) continue;
  EXPECT_EQ(Drain(only, "nodes/999").error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(Drain(only, "nodes/x").error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(Drain(only, "3").error_code(), StatusCode::INVALID_ARGUMENT);
  const grpc::Status unshared = Drain(memory, "nodes/1");
  EXPECT_EQ(unshared.error_code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(unshared.error_message(), HasSubstr("--journal"));
}

TEST_F(NodesTest, HandsItsSessionsOverWhenItIsDrained) {
  Node first(Sharing()), second(Sharing());
  ASSERT_TRUE(first.Create("rig").ok());
  ASSERT_TRUE(first.Create("other").ok());
  ClientStream stream(first.sessions());
  for (const int number : {1, 2}) {
    ASSERT_TRUE(stream.Send("sessions/rig", number, BatchOf(number)));
  }
  v1::Node told;
  while (told.name().empty() || Nodes(second).nodes_size() < 2) {
    told = Told(second, first.address());
  }
  while (Told(second, second.address()).name().empty()) continue;
  const grpc::Status asked = Drain(second, told.name());
  ASSERT_TRUE(asked.ok()) << asked.error_message();
  int64_t acknowledged = 0;
  v1::StreamMeasurementsResponse response;
  while (stream.Read(response)) {
    acknowledged = std::max(acknowledged, response.acknowledgement().sequence());
  }
  const grpc::Status ended = stream.Finish();
  EXPECT_EQ(ended.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_THAT(ended.error_message(), HasSubstr("moves to another daemon"));
  while (Told(second, first.address()).session_count() > 0) continue;
  // The client goes on where it is.
  for (int64_t number = acknowledged + 1; number <= 3; ++number) {
    const grpc::Status added = Insist([&] { return first.Add(static_cast<int>(number)); });
    ASSERT_TRUE(added.ok()) << added.error_message();
  }
  EXPECT_EQ(Told(first, second.address()).session_count(), 1);
  EXPECT_TRUE(Told(first, first.address()).draining());
  EXPECT_EQ(Batches(), 3);
  EXPECT_EQ(EstimateAt(first), Undisturbed(3));
  ASSERT_TRUE(first.Create("new").ok());
  EXPECT_EQ(Told(first, first.address()).session_count(), 0);
  first.process().Signal(SIGTERM);
  EXPECT_EQ(first.process().Wait(), 0);
  EXPECT_EQ(EstimateAt(second), Undisturbed(3));
}

TEST_F(NodesTest, LetsGoOfItsSessionsWhenItStops) {
  Node first(Sharing()), second(Sharing());
  ASSERT_TRUE(first.Create("rig").ok());
  ASSERT_TRUE(first.Add(1).ok());
  first.process().Signal(SIGTERM);
  EXPECT_EQ(first.process().Wait(), 0);
  // No lease has to end first.
  const grpc::Status added = second.Add(2);
  EXPECT_TRUE(added.ok()) << added.error_message();
  EXPECT_EQ(Nodes(second).nodes_size(), 1);
  EXPECT_EQ(EstimateAt(second), Undisturbed(2));
}

TEST_F(NodesTest, FindsOperationsOfOtherDaemons) {
  Node first(Sharing()), second(Sharing());
  ASSERT_TRUE(first.Create("rig").ok());
  ASSERT_TRUE(first.Add(1).ok());
  const auto here = v1::OperationService::NewStub(first.channel());
  const auto there = v1::OperationService::NewStub(second.channel());
  v1::StartComputationRequest start;
  start.mutable_estimate()->mutable_subject()->set_session("sessions/rig");
  v1::Operation operation;
  grpc::ClientContext starting;
  const grpc::Status started = there->StartComputation(&starting, start, &operation);
  ASSERT_TRUE(started.ok()) << started.error_message();
  const auto get = [&](v1::OperationService::Stub& stub) {
    grpc::ClientContext context;
    v1::GetOperationRequest request;
    request.set_name(operation.name());
    return stub.GetOperation(&context, request, &operation);
  };
  do {
    const grpc::Status got = get(*there);
    ASSERT_TRUE(got.ok()) << got.error_message();
  } while (operation.state() == v1::Operation::QUEUED ||
           operation.state() == v1::Operation::RUNNING);
  EXPECT_EQ(operation.state(), v1::Operation::SUCCEEDED) << operation.error().message();
  ASSERT_TRUE(get(*here).ok());
  grpc::ClientContext context;
  v1::DeleteOperationRequest request;
  request.set_name(operation.name());
  google::protobuf::Empty empty;
  ASSERT_TRUE(there->DeleteOperation(&context, request, &empty).ok());
  EXPECT_EQ(get(*there).error_code(), StatusCode::NOT_FOUND);
}

TEST_F(NodesTest, RefusesOptionsThatWouldNotHold) {
  const auto refuse = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--listen", "127.0.0.1:0"});
    DaemonProcess daemon(std::move(arguments));
    EXPECT_NE(daemon.Wait(), 0);
    return daemon.Errors();
  };
  EXPECT_THAT(refuse({"--node-secret", secret_}),
              HasSubstr("--node-secret: only daemons that share"));
  EXPECT_THAT(refuse({"--journal", uri_, "--node-ca", secret_}),
              HasSubstr("--node-ca: needs --node-secret"));
  EXPECT_THAT(refuse({"--journal", uri_, "--node-secret", secret_, "--tls-certificate", secret_,
                      "--tls-key", secret_}),
              HasSubstr("which needs --node-ca"));
  const std::string few = folder_.Write("few", "secret");
  EXPECT_THAT(refuse({"--journal", uri_, "--node-secret", few}),
              HasSubstr("--node-secret: " + few + " must have one line of 32 to 256"));
}

}  // namespace
}  // namespace polyest::internal
