// Tests what an engineer relies on. Whatever happens to the daemon and to the network, every
// acknowledged batch is stored, none is stored twice, and the estimates are those of an undisturbed
// run, to the last bit.

#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <random>
#include <thread>

#include "polyest/client.h"
#include "polyest/measurement_stream.h"
#include "tests/integration/daemon_fixture.h"
#include "tests/testing/hostile_proxy.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

constexpr int kSessions = 8;
constexpr int kRowsABatch = 4;

std::string SessionName(int session) { return "sessions/rig-" + std::to_string(session); }

// Returns a batch of a session; each session has a record of its own.
v1::Measurements Batch(int session, int batch) {
  const int first = kRowsABatch * batch;
  v1::Measurements rows = OscillatorRows(first, first + kRowsABatch);
  for (double& value : *rows.mutable_channels(0)->mutable_values()) value *= 1 + 0.01 * session;
  return rows;
}

v1::Estimate EstimateOf(const std::string& address, const std::string& session) {
  Client client(address);
  v1::GetEstimateRequest request;
  request.set_session(session);
  const auto estimate = client.GetEstimate(request);
  EXPECT_TRUE(estimate.ok()) << estimate.status();
  return estimate.ok() ? *estimate : v1::Estimate();
}

// Eight writers. Each streams a record and comes back whenever it loses the daemon.
class Campaign {
 public:
  Campaign(std::string address, int batches)
      : address_(std::move(address)), batches_(batches), acknowledged_(kSessions) {
    for (auto& last : acknowledged_) last = 0;
  }

  void CreateSessions() const {
    Client client(address_);
    for (int session = 0; session < kSessions; ++session) {
      v1::CreateSessionRequest request;
      request.set_session_id(SessionName(session).substr(9));
      *request.mutable_session()->mutable_problem() = Oscillator();
      ASSERT_TRUE(client.CreateSession(request).ok());
    }
  }

  // Starts the writers in the background.
  void Start() {
    for (int session = 0; session < kSessions; ++session) {
      writers_.emplace_back([this, session] { Write(session); });
    }
  }
  void Join() {
    for (auto& writer : writers_) writer.join();
    writers_.clear();
  }
  // Waits until `more` more batches are acknowledged, or all are.
  void AwaitAcknowledgements(int64_t more) {
    const int64_t enough = std::min<int64_t>(total_ + more, kSessions * batches_);
    for (int64_t now = total_; now < enough; now = total_) total_.wait(now);
  }
  int64_t total() const { return total_; }
  int64_t acknowledged(int session) const { return acknowledged_[static_cast<size_t>(session)]; }
  int batches() const { return batches_; }

 private:
  void Write(int session) {
    Client client(address_);
    MeasurementStreamOptions options;
    options.first_delay = std::chrono::milliseconds(5);
    options.max_delay = std::chrono::milliseconds(100);
    options.max_attempts = 10'000;
    options.estimates.emplace().set_batch_count(10);
    MeasurementStreamCallbacks callbacks;
    auto& last = acknowledged_[static_cast<size_t>(session)];
    callbacks.acknowledgement = [&](const v1::Acknowledgement& acknowledgement) {
      const int64_t before = last;
      last = std::max<int64_t>(before, acknowledgement.sequence());
      total_ += last - before;
      total_.notify_all();
    };
    MeasurementStream stream(client, SessionName(session), options, callbacks);
    absl::Status status = stream.Open();
    for (int batch = 0; status.ok() && batch < batches_; ++batch) {
      status = stream.Send(Batch(session, batch));
    }
    if (status.ok()) status = stream.Finish().status();
    EXPECT_TRUE(status.ok()) << status;
    // The batches of a writer that gave up count as done, so that the test does not wait for them.
    total_ += batches_ - last;
    total_.notify_all();
  }

  const std::string address_;
  const int batches_;
  std::vector<std::atomic<int64_t>> acknowledged_;
  std::atomic<int64_t> total_ = 0;
  std::vector<std::thread> writers_;
};

// Expects the sent batches, no more and no fewer, and the estimates of an undisturbed daemon.
void ExpectUndisturbed(const Campaign& campaign, const std::string& address) {
  DaemonProcess peaceful({"--listen", "127.0.0.1:0", "--durability", "memory"});
  const std::string peaceful_address = peaceful.ReadAddress();
  Campaign again(peaceful_address, campaign.batches());
  again.CreateSessions();
  again.Start();
  again.Join();
  Client client(address);
  for (int session = 0; session < kSessions; ++session) {
    v1::GetSessionRequest request;
    request.set_name(SessionName(session));
    const auto found = client.GetSession(request);
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_EQ(found->last_sequence(), campaign.batches());
    EXPECT_EQ(found->sample_count(), campaign.batches() * kRowsABatch);
    EXPECT_EQ(WithoutSequence(EstimateOf(address, SessionName(session))),
              WithoutSequence(EstimateOf(peaceful_address, SessionName(session))));
  }
}

int Crashes() {
  const char* const crashes = std::getenv("POLYEST_TEST_CRASHES");
  return crashes == nullptr ? 20 : std::atoi(crashes);
}

TEST(Durability, NothingAcknowledgedIsLostHoweverOftenTheDaemonIsKilled) {
  const TestFolder data;
  const int crashes = Crashes();
  // Not 127.0.0.1, where an attempt to connect while no daemon runs might come from the very port
  // that it looks for, and take it.
  std::vector<std::string> arguments = {"--data-dir", data.path(), "--listen", "127.0.0.2:0"};
  auto daemon = std::make_unique<DaemonProcess>(arguments);
  const std::string address = daemon->ReadAddress();
  arguments.back() = address;
  Campaign campaign(address, 5 * crashes);
  campaign.CreateSessions();
  campaign.Start();
  std::mt19937_64 random(7);
  for (int crash = 0; crash < crashes; ++crash) {
    campaign.AwaitAcknowledgements(std::uniform_int_distribution<int64_t>(1, 40)(random));
    std::vector<int64_t> acknowledged;
    for (int i = 0; i < kSessions; ++i) acknowledged.push_back(campaign.acknowledged(i));
    daemon->Signal(SIGKILL);
    daemon->Wait();
    daemon = std::make_unique<DaemonProcess>(arguments);
    ASSERT_EQ(daemon->ReadAddress(), address) << daemon->Errors();
    Client client(address);
    for (int i = 0; i < kSessions; ++i) {
      v1::GetSessionRequest request;
      request.set_name(SessionName(i));
      const auto found = client.GetSession(request);
      ASSERT_TRUE(found.ok()) << found.status();
      EXPECT_GE(found->last_sequence(), acknowledged[static_cast<size_t>(i)]);
    }
  }
  campaign.Join();
  ExpectUndisturbed(campaign, address);
}

TEST(Durability, NothingIsLostOrCountedTwiceOverANetworkThatCutsDelaysAndRepeats) {
  DaemonProcess daemon({"--listen", "127.0.0.1:0"});
  const std::string address = daemon.ReadAddress();
  HostileProxy proxy(address, /*seed=*/11);
  Campaign campaign(proxy.address(), 100);
  campaign.CreateSessions();
  proxy.SetHostile(true);
  campaign.Start();
  campaign.AwaitAcknowledgements(kSessions * 100);
  // The network is left in peace for the last estimates.
  proxy.SetHostile(false);
  campaign.Join();
  EXPECT_GT(proxy.harm().cut, 20);
  EXPECT_GT(proxy.harm().held, 2);
  EXPECT_GT(proxy.harm().repeated, 5);
  ExpectUndisturbed(campaign, address);
}

}  // namespace
}  // namespace polyest::internal
