// Tests the metrics that Prometheus scrapes.

#include <gmock/gmock.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "tests/integration/operations_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class MetricsTest : public DaemonTest {
 protected:
  MetricsTest() : DaemonTest({"--metrics", "127.0.0.1:0", "--max-sessions", "1"}) {}

  void SetUp() override {
    DaemonTest::SetUp();
    const std::string line = daemon_.ReadLine();
    const std::string start = "metrics on 127.0.0.1:";
    ASSERT_EQ(line.substr(0, start.size()), start);
    port_ = PortOf(line);
  }

  int port_ = 0;
};

TEST_F(MetricsTest, CountWhatAStreamHasBrought) {
  ASSERT_TRUE(Create("rig").ok());
  ClientStream stream(*sessions_);
  constexpr int kBatches = 3;
  for (int batch = 0; batch < kBatches; ++batch) {
    ASSERT_TRUE(
        stream.Send("sessions/rig", batch + 1, OscillatorRows(10 * batch, 10 * batch + 10)));
    stream.ExpectAcknowledgement(batch + 1);
    v1::Estimate estimate;
    stream.ExpectEstimate(estimate);
  }
  const std::string open = Scrape(port_);
  EXPECT_EQ(ValueOf("polyest_writers", open), 1);
  EXPECT_EQ(ValueOf("polyest_journal_waiting_batches", open), 0);
  EXPECT_EQ(ValueOf("polyest_unprocessed_batches", open), 0);
  stream.HalfClose();
  v1::Estimate last;
  stream.ExpectEstimate(last);
  ASSERT_TRUE(stream.Finish().ok());

  const std::string text = Scrape(port_);
  EXPECT_THAT(text, HasSubstr("HTTP/1.1 200 OK"));
  EXPECT_EQ(ValueOf("polyest_batches_acknowledged_total", text), kBatches);
  EXPECT_EQ(ValueOf("polyest_rows_acknowledged_total", text), 10 * kBatches);
  EXPECT_EQ(ValueOf("polyest_stored_rows", text), 10 * kBatches);
  EXPECT_EQ(ValueOf("polyest_values_acknowledged_total", text), 10 * kBatches);
  // 30 rows, 20 a second, have 29 steps of 0.05 s between them.
  EXPECT_NEAR(ValueOf("polyest_measured_seconds_total", text), 1.45, 1e-9);
  EXPECT_GT(ValueOf("polyest_computed_seconds_total", text), 0);
  EXPECT_EQ(ValueOf("polyest_acknowledgement_duration_seconds_count", text), kBatches);
  EXPECT_EQ(ValueOf("polyest_estimate_duration_seconds_count", text), kBatches);
  EXPECT_EQ(ValueOf("polyest_reexpansions_total", text), last.expansion().reexpansions());
  EXPECT_EQ(ValueOf("polyest_calls_total{code=\"OK\",method=\"StreamMeasurements\"}", text), 1);
  EXPECT_EQ(ValueOf("polyest_calls_total{code=\"OK\",method=\"CreateSession\"}", text), 1);
  EXPECT_EQ(ValueOf("polyest_call_duration_seconds_count{method=\"CreateSession\"}", text), 1);
  EXPECT_THAT(text, Not(HasSubstr("polyest_call_duration_seconds_count{method=\"Stream")));
  EXPECT_EQ(ValueOf("polyest_sessions", text), 1);
  EXPECT_EQ(ValueOf("polyest_sessions_loaded", text), 1);
  EXPECT_EQ(ValueOf("polyest_ready", text), 1);
  // The commits are the check that the journal can be written, the session, and each batch.
  EXPECT_EQ(ValueOf("polyest_journal_commit_duration_seconds_count", text), 2 + kBatches);
  EXPECT_EQ(ValueOf("polyest_journal_commit_failures_total", text), 0);
  EXPECT_GT(ValueOf("polyest_journal_file_bytes", text), 0);
  EXPECT_GT(ValueOf("polyest_disk_free_bytes", text), 0);
  EXPECT_GT(ValueOf("process_resident_memory_bytes", text), 1 << 20);
  EXPECT_THAT(text, Not(HasSubstr("\"rig")));
  EXPECT_THAT(text, Not(HasSubstr("sessions/rig")));
}

TEST_F(MetricsTest, CountRefusalsByCode) {
  ASSERT_TRUE(Create("one").ok());
  EXPECT_EQ(Create("two").error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(Delete("sessions/none").error_code(), grpc::StatusCode::NOT_FOUND);
  const std::string text = Scrape(port_);
  EXPECT_EQ(ValueOf("polyest_refusals_total{code=\"RESOURCE_EXHAUSTED\"}", text), 1);
  EXPECT_EQ(ValueOf("polyest_refusals_total{code=\"UNAUTHENTICATED\"}", text), 0);
  EXPECT_EQ(ValueOf("polyest_calls_total{code=\"NOT_FOUND\",method=\"DeleteSession\"}", text), 1);
}

TEST_F(MetricsTest, CountRefusedConnectionsWhichOnlyRise) {
  const std::string text = Scrape(port_);
  EXPECT_THAT(text, HasSubstr("# TYPE polyest_refused_connections_total counter"));
  EXPECT_EQ(ValueOf("polyest_refused_connections_total", text), 0);
}

TEST_F(MetricsTest, HaveEveryNameThatTheAlertsUse) {
  std::ifstream in(POLYEST_SOURCE_DIR "/deploy/monitoring/alerts.yml");
  std::ostringstream alerts;
  alerts << in.rdbuf();
  const std::string rules = alerts.str();
  const std::string text = Scrape(port_);
  const std::regex name("polyest_[a-z_]+");
  int names = 0;
  for (std::sregex_iterator it(rules.begin(), rules.end(), name), end; it != end; ++it, ++names) {
    EXPECT_THAT(text, HasSubstr("\n" + it->str())) << it->str();
  }
  EXPECT_GT(names, 5);
}

TEST_F(MetricsTest, GetStatusSaysHowTheDaemonIs) {
  ASSERT_TRUE(Create("rig").ok());
  grpc::ClientContext context;
  v1::DaemonStatus status;
  ASSERT_TRUE(status_->GetStatus(&context, {}, &status).ok());
  EXPECT_FALSE(status.version().empty());
  EXPECT_TRUE(status.durable());
  EXPECT_EQ(status.session_count(), 1);
  EXPECT_EQ(status.loaded_session_count(), 1);
  EXPECT_EQ(status.writer_count(), 0);
  EXPECT_EQ(status.watcher_count(), 0);
  EXPECT_EQ(status.waiting_task_count(), 0);
  EXPECT_GT(status.uptime_s(), 0);
  EXPECT_GT(status.memory_bytes(), 1 << 20);
}

TEST(MetricsAddressTest, IsNotBeyondLoopbackUnlessWished) {
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--metrics", "0.0.0.0:0"});
  EXPECT_EQ(daemon.Wait(), 2);
  EXPECT_THAT(daemon.Errors(), HasSubstr("polyestd: --metrics: 0.0.0.0 is beyond loopback"));
}

TEST_F(MetricsTest, OfASecondDaemonNeedAPortOfTheirOwn) {
  DaemonProcess daemon(
      {"--listen", "127.0.0.1:0", "--metrics", "127.0.0.1:" + std::to_string(port_)});
  EXPECT_EQ(daemon.Wait(), 1);
  EXPECT_THAT(daemon.Errors(), HasSubstr("--metrics: cannot listen on 127.0.0.1:"));
}

TEST_F(MetricsTest, AreThereThoughOtherClientsSayNothing) {
  // They are more than the endpoint has threads, and are let go one after the other.
  std::vector<int> silent;
  for (int i = 0; i < 20; ++i) {
    silent.push_back(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port_));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(connect(silent.back(), reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  EXPECT_EQ(ValueOf("polyest_ready", Scrape(port_)), 1);
  for (const int one : silent) close(one);
}

}  // namespace
}  // namespace polyest::internal
