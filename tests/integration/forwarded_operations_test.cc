// Tests that any daemon of a database lists the operations of all.

#include <signal.h>

#include "tests/integration/forwarding_fixture.h"

namespace polyest::internal {
namespace {

using grpc::StatusCode;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ForwardedOperationsTest : public ForwardingTest {
 protected:
  // Starts a computation that belongs to no session; returns its name.
  static std::string StartComputation(Node& node) {
    grpc::ClientContext context;
    v1::StartComputationRequest request;
    v1::ComputePropagationRequest& propagation = *request.mutable_propagation();
    *propagation.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
    propagation.set_until_s(1);
    propagation.set_step_s(1);
    v1::Operation operation;
    const grpc::Status started = v1::OperationService::NewStub(node.channel())
                                     ->StartComputation(&context, request, &operation);
    EXPECT_TRUE(started.ok()) << started.error_message();
    return operation.name();
  }
  static grpc::Status ListPage(Node& node, int size, const std::string& token,
                               v1::ListOperationsResponse& page) {
    grpc::ClientContext context;
    v1::ListOperationsRequest request;
    request.set_page_size(size);
    request.set_page_token(token);
    return v1::OperationService::NewStub(node.channel())->ListOperations(&context, request, &page);
  }
  // Returns the names of all operations, from pages of this size.
  static std::vector<std::string> Operations(Node& node, int page_size) {
    std::vector<std::string> names;
    v1::ListOperationsResponse page;
    do {
      const std::string token = page.next_page_token();
      const grpc::Status listed = ListPage(node, page_size, token, page);
      EXPECT_TRUE(listed.ok()) << listed.error_message();
      if (!listed.ok()) return names;
      for (const v1::Operation& operation : page.operations()) names.push_back(operation.name());
    } while (!page.next_page_token().empty());
    return names;
  }
};

TEST_F(ForwardedOperationsTest, ListsTheOperationsOfAllDaemons) {
  Node first(Sharing());
  auto second = std::make_unique<Node>(Sharing());
  Node third(Sharing());
  const std::vector<std::string> started = {StartComputation(first), StartComputation(third),
                                            StartComputation(first), StartComputation(*second)};
  const std::vector<std::string> in_order = {started[0], started[2], started[3], started[1]};
  for (Node* node : {&first, second.get(), &third}) {
    EXPECT_EQ(Operations(*node, 1), in_order);
    EXPECT_EQ(Operations(*node, 50), in_order);
  }
  // Those of a daemon that has died are gone when its lease is over, also where it owns a session.
  ASSERT_TRUE(second->Create("rig").ok());
  v1::ListOperationsResponse page;
  ASSERT_TRUE(ListPage(third, 50, "", page).ok());
  const std::string of_second = page.next_page_token();
  second->process().Signal(SIGKILL);
  EXPECT_TRUE(Insist([&] { return ListPage(third, 50, of_second, page); }).ok());
  EXPECT_THAT(Operations(third, 1), ElementsAre(started[0], started[2], started[1]));
  EXPECT_TRUE(ListPage(first, 1, "999-0", page).ok());
  EXPECT_EQ(page.operations_size(), 0);
  for (const char* token : {"1", "-", "1-", "-1", "0-1", "1--1", "1-2-3", "x-1", "1-9e9"}) {
    const grpc::Status refused = ListPage(first, 1, token, page);
    EXPECT_EQ(refused.error_code(), StatusCode::INVALID_ARGUMENT) << token;
    EXPECT_THAT(refused.error_message(), HasSubstr("is not the nextPageToken")) << token;
  }
}

}  // namespace
}  // namespace polyest::internal
