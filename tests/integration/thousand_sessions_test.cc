// Tests a daemon that runs for months: a thousand sessions come and go and leave nothing behind.
// The leak sanitizer in the build `asan-ubsan` finds memory that cannot be reached any more; this
// test finds reachable memory that grows.

#include <malloc.h>

#include <thread>

#include "core/common/sanitizer.h"
#include "server/daemon/daemon.h"
#include "server/telemetry/process_info.h"
#include "tests/integration/daemon_fixture.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

constexpr int kAtATime = 100;
constexpr int kEstimated =
    10;  // estimates one session in ten, because an estimate takes most of the time
constexpr int kRowsABatch = 3;

v1::Problem Tiny() {
  return ProblemFromJson(R"({
    "model": {"builtin": "mass_spring_damper"},
    "fixed": {"m": 1, "x0": 1, "c": 0.17},
    "uncertain": [{"name": "k", "uniform": {"lower": 31.58, "upper": 47.37}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}],
    "expansion": {"order": 2, "adaptive": false}
  })");
}

class ThousandSessionsTest : public testing::Test {
 protected:
  void SetUp() override {
    auto daemon = Daemon::Start({.listen = {{"127.0.0.1", 0}},
                                 .data_dir = data_.path(),
                                 .unload_after = std::chrono::milliseconds(20)});
    ASSERT_TRUE(daemon.ok()) << daemon.status();
    daemon_ = *std::move(daemon);
    const auto channel = grpc::CreateChannel(daemon_->addresses().front().ToString(),
                                             grpc::InsecureChannelCredentials());
    sessions_ = v1::SessionService::NewStub(channel);
    status_ = v1::StatusService::NewStub(channel);
  }

  // Takes some sessions through their life, from the first call to the last.
  void LiveThrough() {
    std::vector<std::string> names(kAtATime);
    for (std::string& name : names) name = Create();
    for (int i = 0; i < kAtATime; ++i)
      Stream(names[static_cast<size_t>(i)], /*to_the_end=*/i % kEstimated == 0);
    // The housekeeper unloads the sessions meanwhile.
    while (Status().loaded_session_count() > 0) std::this_thread::yield();
    for (const std::string& name : names) Add(name);
    for (int i = 0; i < kAtATime; i += kEstimated) Estimate(names[static_cast<size_t>(i)]);
    for (const std::string& name : names) Delete(name);
    ASSERT_EQ(Status().session_count(), 0);
  }

  std::string Create() {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    *request.mutable_session()->mutable_problem() = Tiny();
    v1::Session session;
    EXPECT_TRUE(sessions_->CreateSession(&context, request, &session).ok());
    return session.name();
  }

  // Streams one batch. Unless `to_the_end`, the client then cancels the stream.
  void Stream(const std::string& session, bool to_the_end) {
    ClientStream stream(*sessions_);
    stream.Send(session, 1, OscillatorRows(0, kRowsABatch),
                [](auto& request) { request.mutable_estimates()->set_only_last(true); });
    stream.ExpectAcknowledgement(1);
    if (!to_the_end) {
      stream.Cancel();
      EXPECT_EQ(stream.Finish().error_code(), grpc::StatusCode::CANCELLED);
      return;
    }
    stream.HalfClose();
    v1::Estimate estimate;
    stream.ExpectEstimate(estimate);
    EXPECT_TRUE(stream.Finish().ok());
  }

  // Adds another batch, which brings the session back from disk.
  void Add(const std::string& session) {
    grpc::ClientContext context;
    v1::AddMeasurementsRequest request;
    request.set_session(session);
    request.set_sequence(2);
    *request.mutable_measurements() = OscillatorRows(kRowsABatch, 2 * kRowsABatch);
    v1::AddMeasurementsResponse response;
    EXPECT_TRUE(sessions_->AddMeasurements(&context, request, &response).ok());
    EXPECT_EQ(response.acknowledgement().sample_count(), 2 * kRowsABatch);
  }

  void Estimate(const std::string& session) {
    grpc::ClientContext context;
    v1::GetEstimateRequest request;
    request.set_session(session);
    v1::Estimate response;
    EXPECT_TRUE(sessions_->GetEstimate(&context, request, &response).ok());
    EXPECT_EQ(response.samples(), 2 * kRowsABatch);
  }

  void Delete(const std::string& session) {
    grpc::ClientContext context;
    v1::DeleteSessionRequest request;
    request.set_name(session);
    google::protobuf::Empty response;
    EXPECT_TRUE(sessions_->DeleteSession(&context, request, &response).ok());
  }

  v1::DaemonStatus Status() {
    grpc::ClientContext context;
    v1::DaemonStatus status;
    EXPECT_TRUE(status_->GetStatus(&context, {}, &status).ok());
    return status;
  }

  const TestFolder data_;
  std::unique_ptr<Daemon> daemon_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
  std::unique_ptr<v1::StatusService::Stub> status_;
};

struct Memory {
  int64_t allocated = static_cast<int64_t>(mallinfo2().uordblks + mallinfo2().hblkhd);
  int64_t resident = ResidentMemoryBytes();
};

constexpr bool kSanitized = POLYEST_ADDRESS_SANITIZER || POLYEST_THREAD_SANITIZER;

// What threads have not let go of yet when a round ends comes and goes, and a thread that works for
// the first time keeps buffers of its own; what sessions leave behind stays, and grows. So five
// hundred sessions that end above the limit are followed by others, which a leak would not let end
// below it. A sanitizer's own memory grows with the memory that was freed, but it finds what a
// hundred sessions have left, and races between them, as well as of a thousand.
TEST_F(ThousandSessionsTest, LeaveNothingBehind) {
  constexpr int kMaxTries = 4;
  if (kSanitized) {
    LiveThrough();
    daemon_->Stop();
    return;
  }
  const auto above_limit = [](const Memory& full, const Memory& half) {
    return full.allocated - half.allocated >= 500 * 1'000 ||
           full.resident - half.resident >= 500 * 16'384;
  };
  const auto live_through_half = [this] {
    for (int sessions = 0; sessions < 500; sessions += kAtATime) LiveThrough();
    return Memory();
  };
  Memory half = live_through_half();
  Memory full = live_through_half();
  for (int tries = 0; above_limit(full, half) && tries < kMaxTries; ++tries) {
    half = full;
    full = live_through_half();
  }
  RecordProperty("allocated_growth_bytes", std::to_string(full.allocated - half.allocated));
  RecordProperty("resident_growth_bytes", std::to_string(full.resident - half.resident));
  EXPECT_FALSE(above_limit(full, half));
  daemon_->Stop();
}

}  // namespace
}  // namespace polyest::internal
