// Tests files stored by the version before the services by resource: `stored/journal.db` is its
// journal, `stored/session.polyest` its command's export, and `stored/estimate.json` its last
// estimate, of 200 rows of client/examples/oscillator.csv in four batches.

#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "client/cli/session_file.h"
#include "polyest/client.h"
#include "proto/wire/json/json_format.h"
#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

std::filesystem::path Stored(const std::string& name) {
  return std::filesystem::path(POLYEST_SOURCE_DIR) / "tests" / "integration" / "stored" / name;
}

class StoredByAnOlderVersionTest : public testing::Test {
 protected:
  void Serve(const std::string& folder) {
    daemon_.emplace(std::vector<std::string>{"--listen", "127.0.0.1:0", "--data-dir", folder});
    address_ = daemon_->ReadAddress();
    ASSERT_FALSE(address_.empty()) << daemon_->Errors();
    sessions_ = v1::SessionService::NewStub(
        grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
  }

  // Expects the session to be unchanged, to go on, and to give its former estimate. Rounding
  // differs between machines: the tolerance of a millionth is a thousandth of the data's
  // uncertainty.
  void ExpectTheSameEstimate() {
    grpc::ClientContext getting, estimating;
    v1::GetSessionRequest get;
    get.set_name("sessions/stored");
    v1::Session session;
    ASSERT_TRUE(sessions_->GetSession(&getting, get, &session).ok());
    EXPECT_EQ(session.last_sequence(), 4);
    EXPECT_EQ(session.sample_count(), 200);
    EXPECT_EQ(session.last_time_s(), 10);
    EXPECT_EQ(session.problem().expansion().order(), 2);
    v1::GetEstimateRequest request;
    request.set_session(get.name());
    v1::Estimate now;
    const grpc::Status status = sessions_->GetEstimate(&estimating, request, &now);
    ASSERT_TRUE(status.ok()) << status.error_message();
    const v1::Estimate then = EstimateThen();
    EXPECT_EQ(now.sequence(), then.sequence());
    EXPECT_EQ(now.samples(), then.samples());
    EXPECT_EQ(now.time(), then.time());
    ASSERT_EQ(now.parameters_size(), then.parameters_size());
    for (int i = 0; i < now.parameters_size(); ++i) {
      const v1::ParameterEstimate& parameter = then.parameters(i);
      EXPECT_EQ(now.parameters(i).name(), parameter.name());
      // Another build rounds differently, which moves the draws and with them the expansion a
      // little.
      EXPECT_NEAR(now.parameters(i).map(), parameter.map(), 1e-3 * parameter.std_dev());
      EXPECT_NEAR(now.parameters(i).std_dev(), parameter.std_dev(), 1e-3 * parameter.std_dev());
    }
  }

  static v1::Estimate EstimateThen() {
    std::ifstream in(Stored("estimate.json"));
    std::stringstream json;
    json << in.rdbuf();
    v1::Estimate estimate;
    const absl::Status parsed = FromJson(json.str(), estimate);
    EXPECT_TRUE(parsed.ok()) << parsed;
    return estimate;
  }

  const TestFolder folder_;
  std::optional<DaemonProcess> daemon_;
  std::string address_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
};

TEST_F(StoredByAnOlderVersionTest, LoadsFromItsJournal) {
  std::filesystem::copy_file(Stored("journal.db"), folder_ / "journal.db");
  std::filesystem::permissions(folder_ / "journal.db", std::filesystem::perms::owner_read |
                                                           std::filesystem::perms::owner_write);
  Serve(folder_.path());
  ExpectTheSameEstimate();
  grpc::ClientContext context;
  v1::AddMeasurementsRequest more;
  more.set_session("sessions/stored");
  more.set_sequence(5);
  *more.mutable_measurements() = OscillatorRows(200, 210);
  v1::AddMeasurementsResponse response;
  const grpc::Status status = sessions_->AddMeasurements(&context, more, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.acknowledgement().sample_count(), 210);
}

TEST_F(StoredByAnOlderVersionTest, ImportsWhatItHasExported) {
  Serve(folder_.path());
  const auto reader = SessionFileReader::Open(Stored("session.polyest"));
  ASSERT_TRUE(reader.ok()) << reader.status();
  Client client(address_);
  const auto imported = client.ImportSession("", [&] { return (*reader)->Read(); });
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_EQ(imported->name(), "sessions/stored");
  ExpectTheSameEstimate();
}

}  // namespace
}  // namespace polyest::internal
