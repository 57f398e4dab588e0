#include <absl/strings/str_cat.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>

#include "server/net/descriptor.h"
#include "server/net/listening_sockets.h"
#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// Makes a call as bytes, to a service whose messages are not compiled in here.
std::string CallRaw(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                    const std::string& request) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  const grpc::Slice slice(request);
  const grpc::ByteBuffer bytes(&slice, 1);
  auto call = stub.PrepareUnaryCall(&context, method, bytes, &queue);
  call->StartCall();
  grpc::ByteBuffer response;
  grpc::Status status;
  call->Finish(&response, &status, &queue);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  EXPECT_TRUE(status.ok()) << status.error_message();
  std::vector<grpc::Slice> slices;
  response.Dump(&slices);
  std::string answer;
  for (const auto& part : slices) {
    answer.append(reinterpret_cast<const char*>(part.begin()), part.size());
  }
  return answer;
}

class LifecycleTest : public DaemonTest {
 protected:
  std::string CallRaw(const std::string& method, const std::string& request) {
    return internal::CallRaw(channel_, method, request);
  }
};

TEST_F(LifecycleTest, AnswersTheHealthCheckForAllAndForTheService) {
  // The wire format: HealthCheckRequest{service = 1}; HealthCheckResponse{status = 1 (SERVING)}.
  EXPECT_EQ(CallRaw("/grpc.health.v1.Health/Check", ""), "\x08\x01");
  const std::string service = "polyest.v1.SessionService";
  EXPECT_EQ(CallRaw("/grpc.health.v1.Health/Check",
                    "\x0a" + std::string(1, static_cast<char>(service.size())) + service),
            "\x08\x01");
}

TEST_F(LifecycleTest, TellsOfItsServicesByReflection) {
  // The wire format: ServerReflectionRequest{list_services = 7: ""}.
  const std::string answer = CallRaw(
      "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", std::string("\x3a\x00", 2));
  EXPECT_THAT(answer, HasSubstr("polyest.v1.SessionService"));
  EXPECT_THAT(answer, HasSubstr("grpc.health.v1.Health"));
}

TEST_F(LifecycleTest, GivesEveryStreamItsLastEstimateBeforeItEnds) {
  ASSERT_TRUE(Create("rig").ok());
  ASSERT_TRUE(Create("idle").ok());
  ClientStream stream(*sessions_);
  ASSERT_TRUE(stream.Send("sessions/rig", 1, OscillatorRows(0, 20),
                          [](auto& request) { request.mutable_estimates()->set_only_last(true); }));
  stream.ExpectAcknowledgement(1);
  ClientStream idle(*sessions_);
  v1::StreamMeasurementsRequest hello;
  hello.set_session("sessions/idle");
  ASSERT_TRUE(idle.SendRequest(hello));
  grpc::ClientContext context;
  v1::WatchSessionRequest request;
  request.set_session("sessions/rig");
  auto watch = sessions_->WatchSession(&context, request);
  v1::WatchSessionResponse watched;
  ASSERT_TRUE(watch->Read(&watched));
  EXPECT_EQ(watched.estimate().sequence(), 1);
  const v1::Estimate expected = EstimateAtOnce(20);

  daemon_.Signal(SIGTERM);

  v1::Estimate last;
  stream.ExpectEstimate(last);
  EXPECT_EQ(WithoutSequence(last), WithoutSequence(expected));
  v1::StreamMeasurementsResponse nothing;
  EXPECT_FALSE(stream.Read(nothing));
  EXPECT_EQ(stream.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_FALSE(idle.Read(nothing));
  EXPECT_EQ(idle.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_FALSE(watch->Read(&watched));
  EXPECT_EQ(watch->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(daemon_.Wait(), 0) << daemon_.Errors();
}

class NoDrainTest : public DaemonTest {
 protected:
  NoDrainTest() : DaemonTest({"--drain-timeout-s", "0", "--threads", "1"}) {}
};

// Order 61 in two unknowns is 1953 terms and 19,530 points, whose factorization takes 20 s.
TEST_F(NoDrainTest, EndsALongComputation) {
  v1::StartComputationRequest request;
  v1::Experiment& experiment = *request.mutable_estimate()->mutable_subject()->mutable_experiment();
  *experiment.mutable_problem() = Oscillator();
  experiment.mutable_problem()->mutable_expansion()->set_order(61);
  experiment.mutable_problem()->mutable_expansion()->set_points_per_term(10);
  *experiment.mutable_measurements() = OscillatorRows(0, 1);
  grpc::ClientContext starting;
  v1::Operation operation;
  const grpc::Status started = operations_->StartComputation(&starting, request, &operation);
  ASSERT_TRUE(started.ok()) << started.error_message();
  v1::GetOperationRequest get;
  get.set_name(operation.name());
  while (operation.state() == v1::Operation::QUEUED) {
    grpc::ClientContext getting;
    ASSERT_TRUE(operations_->GetOperation(&getting, get, &operation).ok());
  }
  ASSERT_EQ(operation.state(), v1::Operation::RUNNING);
  daemon_.Signal(SIGTERM);
  EXPECT_EQ(daemon_.Wait(), 0);
  const std::string log = daemon_.Errors();
  if (log.find("[info] stopped\n") != std::string::npos) return;
  // On a busy machine the computation may not come to look at its stop within the three seconds
  // that the daemon waits. One that does not look at it computes all that time.
  EXPECT_THAT(log, HasSubstr("[warning] stopped without computations that went on"));
  EXPECT_LT(daemon_.computed_s(), 2) << log;
}

// Limits the size of the files of programs that are started before it is lifted (ulimit -f).
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit lower{.rlim_cur = bytes, .rlim_max = before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &lower);
  }
  void Lift() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

class SmallFilesTest : private FileSizeLimit, public DaemonTest {
 protected:
  SmallFilesTest() : FileSizeLimit(rlim_t{2} << 20) { Lift(); }
};

TEST_F(SmallFilesTest, RefusesWhatItsFilesCannotHoldAsOnAFullDisk) {
  constexpr int kRows = 5'000;
  ASSERT_TRUE(Create("rig").ok());
  grpc::Status added;
  for (int batch = 0; batch < 100 && added.ok(); ++batch) {
    v1::Measurements rows = OscillatorRows(batch * kRows, (batch + 1) * kRows);
    // Rows without samples are soon computed.
    for (int row = 0; row < kRows; ++row) rows.mutable_channels(0)->add_missing(row);
    added = Add("sessions/rig", batch + 1, rows);
  }
  EXPECT_EQ(added.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << added.error_message();
  EXPECT_THAT(added.error_message(), HasSubstr("the disk is full"));
  daemon_.Signal(SIGTERM);
  EXPECT_EQ(daemon_.Wait(), 0) << daemon_.Errors();
}

TEST_F(LifecycleTest, EndsOnAnInterruptToo) {
  daemon_.Signal(SIGINT);
  EXPECT_EQ(daemon_.Wait(), 0);
}

TEST(Daemon, EndsOnASignalWhileItStarts) {
  // A database that takes a connection and never answers.
  ListeningSockets database;
  int port = 0;
  ASSERT_TRUE(database.Listen("", "127.0.0.1", port).ok());
  for (const int signal : {SIGTERM, SIGINT}) {
    DaemonProcess daemon({"--listen", "127.0.0.1:0", "--journal",
                          absl::StrCat("postgresql://u@127.0.0.1:", port, "/d")});
    const Descriptor connection(database.Accept().descriptor);
    ASSERT_GE(connection.number(), 0);
    daemon.Signal(signal);
    EXPECT_EQ(daemon.Wait(), -signal);
    EXPECT_EQ(daemon.ReadLine(), "");
  }
}

TEST_F(LifecycleTest, SaysInOneLineThatAPortIsInUse) {
  DaemonProcess second({"--listen", address_});
  EXPECT_EQ(second.ReadLine(), "");
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_EQ(second.Errors(),
            "polyestd: --listen: cannot listen on " + address_ + ": the port is in use\n");
}

TEST(Daemon, ListensOnNamesAndIpv6) {
  DaemonProcess by_name({"--listen", "localhost:0"});
  EXPECT_THAT(by_name.ReadLine(), testing::MatchesRegex("listening on localhost:[1-9][0-9]*"));
  for (const char* listen : {"[::1]:0", "[::]:0"}) {
    DaemonProcess daemon({"--listen", listen, "--insecure"});
    const std::string address = daemon.ReadAddress();
    if (address.empty()) GTEST_SKIP() << "this machine has no IPv6: " << daemon.Errors();
    const auto health = [&](const std::string& channel_address) {
      return CallRaw(grpc::CreateChannel(channel_address, grpc::InsecureChannelCredentials()),
                     "/grpc.health.v1.Health/Check", "");
    };
    const std::string port = address.substr(address.rfind(':'));
    EXPECT_EQ(health("[::1]" + port), "\x08\x01") << listen;
    if (std::string(listen) == "[::]:0") {
      EXPECT_EQ(health("127.0.0.1" + port), "\x08\x01");
    }
  }
}

TEST(Daemon, RefusesBadUsageInOneLine) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--listen", "50051"},
                                                    {"--threads", "-1"},
                                                    {"--max-message-mb", "x"},
                                                    {"--log-level", "loud"},
                                                    {"--nonsense"},
                                                    {"--listen"},
                                                    {"extra"}}) {
    DaemonProcess daemon(arguments);
    EXPECT_EQ(daemon.ReadLine(), "");
    EXPECT_EQ(daemon.Wait(), 2) << arguments[0];
    const std::string errors = daemon.Errors();
    EXPECT_THAT(errors, StartsWith("polyestd: "));
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
  }
}

TEST(Daemon, PrintsHelpAndVersion) {
  DaemonProcess help({"--help"});
  std::string text;
  for (std::string line = help.ReadLine(); !line.empty() || text.empty(); line = help.ReadLine()) {
    text += line + "\n";
  }
  EXPECT_EQ(help.Wait(), 0);
  DaemonProcess version({"--version"});
  EXPECT_THAT(version.ReadLine(), StartsWith("polyestd 0."));
  EXPECT_EQ(version.Wait(), 0);
}

}  // namespace
}  // namespace polyest::internal
