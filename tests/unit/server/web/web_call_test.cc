#include "server/web/web_call.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <unistd.h>

#include <future>

namespace polyest::internal {
namespace {

constexpr char kAnswer[] = "answer";

// Answers every call as a unary method does, message and status at once, or by a status alone.
class Answering final : public grpc::CallbackGenericService {
 public:
  explicit Answering(bool with_message) : with_message_(with_message) {}

  // Waits until a call has ended on the side of the server.
  void AwaitEnd() { ended_.get_future().wait(); }

 private:
  class Reactor final : public grpc::ServerGenericBidiReactor {
   public:
    explicit Reactor(Answering& service) : service_(service) {
      const grpc::Slice slice(kAnswer);
      answer_ = grpc::ByteBuffer(&slice, 1);
      StartRead(&request_);
    }
    void OnReadDone(bool) override {
      if (service_.with_message_) {
        StartWriteAndFinish(&answer_, grpc::WriteOptions(), grpc::Status::OK);
      } else {
        Finish(grpc::Status::OK);
      }
    }
    void OnDone() override {
      service_.ended_.set_value();
      delete this;
    }

   private:
    Answering& service_;
    grpc::ByteBuffer request_;
    grpc::ByteBuffer answer_;
  };

  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
    return new Reactor(*this);
  }

  const bool with_message_;
  std::promise<void> ended_;
};

// Calls a service within the process and waits for the answer after the server has ended the call.
struct LateCall {
  explicit LateCall(bool with_message) : service(with_message) {
    grpc::ServerBuilder builder;
    builder.RegisterCallbackGenericService(&service);
    const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
    int sockets[2];
    EXPECT_EQ(pipe(sockets), 0);
    WebCall call(server->InProcessChannel({}), {.method = "/test/Method"});
    service.AwaitEnd();
    status = call.AwaitOnly(sockets[0], message);
    for (const int socket : sockets) close(socket);
  }

  Answering service;
  std::string message;
  std::optional<grpc::Status> status;
};

TEST(WebCall, GetsTheAnswerOfAServerThatHasEndedTheCallBeforeItWaits) {
  const LateCall call(true);
  ASSERT_TRUE(call.status.has_value());
  EXPECT_TRUE(call.status->ok()) << call.status->error_message();
  EXPECT_EQ(call.message, kAnswer);
}

TEST(WebCall, ReportsACallThatEndsWellWithoutAnAnswer) {
  const LateCall call(false);
  ASSERT_TRUE(call.status.has_value());
  EXPECT_EQ(call.status->error_code(), grpc::StatusCode::INTERNAL);
}

}  // namespace
}  // namespace polyest::internal
