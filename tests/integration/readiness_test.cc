// Tests whether the daemon reports that it can take work.

#include <gmock/gmock.h>
#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/generic/generic_stub.h>

#include "tests/integration/operations_fixture.h"

namespace polyest::internal {
namespace {

// The wire format of a HealthCheckRequest is that of a StringValue, of its response an Int32Value.
constexpr int kServing = 1;
constexpr int kNotServing = 2;

// A watch of the health service.
class HealthWatch {
 public:
  HealthWatch(const std::shared_ptr<grpc::Channel>& channel, const std::string& service)
      : stub_(channel) {
    context_.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    call_ = stub_.PrepareCall(&context_, "/grpc.health.v1.Health/Watch", &queue_);
    call_->StartCall(Tag());
    Next();
    google::protobuf::StringValue request;
    request.set_value(service);
    call_->WriteLast(request, {}, Tag());
    Next();
  }
  ~HealthWatch() {
    context_.TryCancel();
    grpc::Status status;
    call_->Finish(&status, Tag());
    Next();
  }

  // Returns the next status; 0 if the watch has ended.
  int Read() {
    google::protobuf::Int32Value response;
    call_->Read(&response, Tag());
    return Next() ? response.value() : 0;
  }

 private:
  void* Tag() { return this; }
  bool Next() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::TemplatedGenericStub<google::protobuf::StringValue, google::protobuf::Int32Value> stub_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<
      grpc::ClientAsyncReaderWriter<google::protobuf::StringValue, google::protobuf::Int32Value>>
      call_;
};

class ReadinessTest : public DaemonTest {
 protected:
  explicit ReadinessTest(const std::vector<std::string>& arguments = {}) : DaemonTest(arguments) {}
};

// A daemon with a journal of at most 1 MiB.
class FullJournalTest : public ReadinessTest {
 protected:
  FullJournalTest() : ReadinessTest({"--max-disk-mb", "1"}) {}
};

TEST_F(ReadinessTest, EndsWithTheDaemon) {
  HealthWatch readiness(channel_, "readiness");
  EXPECT_EQ(readiness.Read(), kServing);
  ASSERT_TRUE(Create("rig").ok());
  ClientStream stream(*sessions_);
  ASSERT_TRUE(stream.Send("sessions/rig", 1, OscillatorRows(0, 20)));
  stream.ExpectAcknowledgement(1);
  daemon_.Signal(SIGTERM);
  EXPECT_EQ(readiness.Read(), kNotServing);
}

TEST_F(FullJournalTest, IsNotReadyUntilThereIsRoomAgain) {
  HealthWatch readiness(channel_, "readiness");
  HealthWatch liveness(channel_, "");
  EXPECT_EQ(readiness.Read(), kServing);
  EXPECT_EQ(liveness.Read(), kServing);
  ASSERT_TRUE(Create("rig").ok());
  grpc::Status status;
  int sequence = 0;
  constexpr int kRows = 2000;  // 16 bytes each
  while (status.ok() && sequence < 100) {
    status =
        Add("sessions/rig", sequence + 1, OscillatorRows(sequence * kRows, (sequence + 1) * kRows));
    ++sequence;
  }
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_EQ(readiness.Read(), kNotServing);
  ASSERT_TRUE(Delete("sessions/rig").ok());
  EXPECT_EQ(readiness.Read(), kServing);
  EXPECT_TRUE(Create("next").ok());
  EXPECT_TRUE(Add("sessions/next", 1, OscillatorRows(0, 10)).ok());
}

}  // namespace
}  // namespace polyest::internal
