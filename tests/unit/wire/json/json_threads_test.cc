// Converts messages of several files at the same time, each for the first time in this process: one
// thread's types must not move while another one reads its own. The thread sanitizer sees if they
// do.

#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <barrier>
#include <memory>
#include <thread>
#include <vector>

#include "polyest/v1/estimate.pb.h"
#include "polyest/v1/model_service.pb.h"
#include "polyest/v1/node_service.pb.h"
#include "polyest/v1/operation_service.pb.h"
#include "polyest/v1/problem.pb.h"
#include "polyest/v1/session_service.pb.h"
#include "polyest/v1/status_service.pb.h"
#include "proto/wire/json/json_format.h"

namespace polyest::internal {
namespace {

TEST(JsonThreads, ConvertMessagesOfAllFilesAtOnce) {
  v1::Estimate estimate;
  estimate.add_parameters()->set_name("k");
  v1::Node node;
  node.set_name("nodes/a");
  v1::Operation operation;
  operation.set_name("operations/a");
  v1::Session session;
  session.set_name("sessions/a");
  v1::Problem problem;
  problem.mutable_model()->set_builtin("quarter_car");
  const v1::DaemonStatus status;
  const v1::ListModelsResponse models;
  const v1::GetStatusRequest request;
  const std::vector<const google::protobuf::Message*> messages = {
      &estimate, &node, &operation, &session, &problem, &status, &models, &request};
  std::barrier<> ready(std::ssize(messages));
  std::vector<std::jthread> threads;
  for (const google::protobuf::Message* const message : messages) {
    threads.emplace_back([&ready, message] {
      ready.arrive_and_wait();
      for (int time = 0; time < 20; ++time) {
        const std::unique_ptr<google::protobuf::Message> read(message->New());
        const absl::Status converted = FromJson(ToJson(*message, /*several_lines=*/false), *read);
        EXPECT_TRUE(converted.ok()) << converted;
        EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(*message, *read));
      }
    });
  }
}

}  // namespace
}  // namespace polyest::internal
