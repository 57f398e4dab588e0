// Tests that a backup which is made while a rig streams has everything that was acknowledged before
// it began, and that a daemon serves it again after the first one is lost.

#include <signal.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "polyest/client.h"
#include "server/journal/journal_check.h"
#include "tests/integration/daemon_fixture.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

// Returns batch `sequence` ≥ 1 of the oscillator's record, one row each.
v1::Measurements RowOf(int64_t sequence) {
  const int row = static_cast<int>(sequence) - 1;
  return OscillatorRows(row, row + 1);
}

// Streams batches as fast as they are acknowledged, until the daemon ends or it is told to stop.
class Rig {
 public:
  explicit Rig(v1::SessionService::Stub& sessions)
      : thread_([this, &sessions](std::stop_token stop) {
          ClientStream stream(sessions);
          v1::StreamMeasurementsResponse response;
          for (int64_t next = 1; !stop.stop_requested(); ++next) {
            if (!stream.Send("sessions/rig", next, RowOf(next))) break;
            do {
              if (!stream.Read(response)) return;
            } while (!response.has_acknowledgement());
            acknowledged_ = response.acknowledgement().sequence();
            acknowledged_.notify_all();
          }
        }) {}

  int64_t acknowledged() const { return acknowledged_; }
  void Await(int64_t sequence) const {
    for (int64_t now = acknowledged_; now < sequence; now = acknowledged_) acknowledged_.wait(now);
  }

 private:
  std::atomic<int64_t> acknowledged_ = 0;
  std::jthread thread_;
};

v1::BackupSummary Download(const std::string& address, const std::string& file) {
  Client client(address);
  std::ofstream out(file, std::ios::binary);
  v1::BackupSummary summary;
  bool ended = false;
  const absl::Status status =
      client.DownloadBackup({}, [&](const v1::DownloadBackupResponse& part) -> absl::Status {
        if (part.has_summary()) summary = part.summary();
        if (part.has_end()) ended = true;
        out << part.chunk();
        return absl::OkStatus();
      });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_TRUE(ended);
  return summary;
}

TEST(Backup, OfADaemonUnderLoadHasAllAcknowledgedBatchesAfterItIsLost) {
  const TestFolder data;
  const TestFolder restored;
  auto daemon = std::make_unique<DaemonProcess>(
      std::vector<std::string>{"--listen", "127.0.0.1:0", "--data-dir", data.path()});
  const std::string address = daemon->ReadAddress();
  const auto sessions =
      v1::SessionService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  {
    Client client(address);
    v1::CreateSessionRequest create;
    create.set_session_id("rig");
    *create.mutable_session()->mutable_problem() = Oscillator();
    ASSERT_TRUE(client.CreateSession(create).ok());
  }
  Rig rig(*sessions);
  rig.Await(100);
  const int64_t before = rig.acknowledged();
  const std::string file = restored / "journal.db";
  const v1::BackupSummary summary = Download(address, file);
  // The rig has gone on meanwhile, and goes on.
  rig.Await(rig.acknowledged() + 1);
  daemon->Signal(SIGKILL);
  daemon->Wait();
  EXPECT_EQ(summary.session_count(), 1);
  EXPECT_GE(summary.batch_count(), before);
  EXPECT_THAT(summary.damage(), testing::IsEmpty());
  EXPECT_EQ(summary.size_bytes(), static_cast<int64_t>(std::filesystem::file_size(file)));
  EXPECT_THAT(CheckJournalFile(file)->damage, testing::IsEmpty());

  DaemonProcess again({"--listen", "127.0.0.1:0", "--data-dir", restored.path()});
  Client client(again.ReadAddress());
  v1::GetSessionRequest get;
  get.set_name("sessions/rig");
  const auto session = client.GetSession(get);
  ASSERT_TRUE(session.ok()) << session.status() << again.Errors();
  EXPECT_EQ(session->last_sequence(), summary.batch_count());
  // All of it is read and computed.
  v1::GetEstimateRequest estimate;
  estimate.set_session("sessions/rig");
  const auto estimated = client.GetEstimate(estimate);
  ASSERT_TRUE(estimated.ok()) << estimated.status();
  EXPECT_EQ(estimated->sequence(), summary.batch_count());
}

}  // namespace
}  // namespace polyest::internal
