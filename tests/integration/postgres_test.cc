// Tests daemons whose sessions are in a PostgreSQL database, one daemon and several.

#include <signal.h>
#include <sys/wait.h>

#include "polyest/rpc/error_details.pb.h"
#include "polyest/v1/backup_service.grpc.pb.h"
#include "tests/integration/daemon_fixture.h"
#include "tests/testing/postgres_server.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::Measurements BatchOf(int number) { return OscillatorRows(10 * (number - 1), 10 * number); }

// A daemon and a client of it.
class Node {
 public:
  explicit Node(std::vector<std::string> arguments, const std::string& listen = "127.0.0.1:0")
      : daemon_([&] {
          arguments.insert(arguments.end(), {"--listen", listen});
          return arguments;
        }()),
        address_(daemon_.ReadAddress()),
        channel_(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials())),
        sessions_(v1::SessionService::NewStub(channel_)) {
    EXPECT_FALSE(address_.empty()) << daemon_.Errors();
  }

  const std::string& address() const { return address_; }
  DaemonProcess& process() { return daemon_; }
  v1::SessionService::Stub& sessions() { return *sessions_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }

  grpc::Status Create(const std::string& id) {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    request.set_session_id(id);
    *request.mutable_session()->mutable_problem() = Oscillator();
    v1::Session session;
    return sessions_->CreateSession(&context, request, &session);
  }
  grpc::Status Delete(const std::string& name) {
    grpc::ClientContext context;
    v1::DeleteSessionRequest request;
    request.set_name(name);
    google::protobuf::Empty empty;
    return sessions_->DeleteSession(&context, request, &empty);
  }
  grpc::Status Add(int number, const std::string& session = "sessions/rig") {
    grpc::ClientContext context;
    v1::AddMeasurementsRequest request;
    request.set_session(session);
    request.set_sequence(number);
    *request.mutable_measurements() = BatchOf(number);
    v1::AddMeasurementsResponse response;
    return sessions_->AddMeasurements(&context, request, &response);
  }
  grpc::Status Get(v1::Session& session, const std::string& name = "sessions/rig") {
    grpc::ClientContext context;
    v1::GetSessionRequest request;
    request.set_name(name);
    return sessions_->GetSession(&context, request, &session);
  }
  grpc::Status Estimate(v1::Estimate& estimate, const std::string& name = "sessions/rig") {
    grpc::ClientContext context;
    v1::GetEstimateRequest request;
    request.set_session(name);
    return sessions_->GetEstimate(&context, request, &estimate);
  }
  std::vector<std::string> Names() {
    grpc::ClientContext context;
    v1::ListSessionsRequest request;
    v1::ListSessionsResponse response;
    const grpc::Status listed = sessions_->ListSessions(&context, request, &response);
    EXPECT_TRUE(listed.ok()) << listed.error_message();
    std::vector<std::string> names;
    for (const v1::Session& session : response.sessions()) names.push_back(session.name());
    return names;
  }
  std::vector<v1::SessionRecord> Export(const std::string& name) {
    grpc::ClientContext context;
    v1::ExportSessionRequest request;
    request.set_name(name);
    const auto reader = sessions_->ExportSession(&context, request);
    std::vector<v1::SessionRecord> records;
    v1::SessionRecord record;
    while (reader->Read(&record)) records.push_back(record);
    const grpc::Status status = reader->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    return records;
  }
  grpc::Status Import(const std::string& id, const std::vector<v1::SessionRecord>& records) {
    grpc::ClientContext context;
    v1::Session imported;
    const auto writer = sessions_->ImportSession(&context, &imported);
    v1::ImportSessionRequest request;
    request.set_session_id(id);
    for (const v1::SessionRecord& record : records) {
      *request.mutable_record() = record;
      if (!writer->Write(request)) break;
    }
    writer->WritesDone();
    return writer->Finish();
  }

 private:
  DaemonProcess daemon_;
  const std::string address_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::SessionService::Stub> sessions_;
};

class PostgresTest : public testing::Test {
 protected:
  std::vector<std::string> Arguments() const { return {"--journal", uri_}; }
  int64_t Batches() const {
    return server_.Number(uri_, "SELECT count(*) FROM polyest.batch WHERE session > 0");
  }
  // Returns the estimate of a daemon that nothing has disturbed, and whose sessions are in memory.
  static std::string Undisturbed(int batches) {
    Node node({"--durability", "memory"});
    EXPECT_TRUE(node.Create("rig").ok());
    for (int number = 1; number <= batches; ++number) EXPECT_TRUE(node.Add(number).ok());
    return EstimateAt(node);
  }
  static std::string EstimateAt(Node& node, const std::string& name = "sessions/rig") {
    v1::Estimate estimate;
    const grpc::Status status = node.Estimate(estimate, name);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return WithoutSequence(estimate);
  }
  // Repeats a call as long as it is UNAVAILABLE, as clients do.
  template <typename Call>
  static grpc::Status Insist(Call call) {
    grpc::Status status = call();
    while (status.error_code() == grpc::StatusCode::UNAVAILABLE) status = call();
    return status;
  }

  PostgresServer& server_ = PostgresServer::Shared();
  const std::string uri_ = server_.MakeDatabase();
};

TEST_F(PostgresTest, GoesOnAfterAKillToTheSameBits) {
  auto node = std::make_unique<Node>(Arguments());
  ASSERT_TRUE(node->Create("rig").ok());
  for (const int number : {1, 2, 3}) ASSERT_TRUE(node->Add(number).ok());
  const std::string address = node->address();
  node->process().Signal(SIGKILL);
  node->process().Wait();
  node = std::make_unique<Node>(Arguments(), address);
  v1::Session session;
  ASSERT_TRUE(Insist([&] { return node->Get(session); }).ok());
  EXPECT_EQ(session.last_sequence(), 3);
  EXPECT_EQ(session.sample_count(), 30);
  const grpc::Status added = node->Add(4);
  EXPECT_TRUE(added.ok()) << added.error_message();
  EXPECT_EQ(EstimateAt(*node), Undisturbed(4));
}

TEST_F(PostgresTest, TakesSessionsFromSqliteAndGivesThemBack) {
  Node sqlite({}), postgres(Arguments()), back({});
  ASSERT_TRUE(sqlite.Create("rig").ok());
  for (const int number : {1, 2, 3}) ASSERT_TRUE(sqlite.Add(number).ok());
  const auto records = sqlite.Export("sessions/rig");
  ASSERT_TRUE(postgres.Import("rig", records).ok());
  EXPECT_EQ(EstimateAt(postgres), EstimateAt(sqlite));
  ASSERT_TRUE(back.Import("rig", postgres.Export("sessions/rig")).ok());
  EXPECT_EQ(EstimateAt(back), EstimateAt(sqlite));
  EXPECT_EQ(postgres.Import("rig", records).error_code(), grpc::StatusCode::ALREADY_EXISTS);
}

TEST_F(PostgresTest, AdvisesTheDatabasesOwnBackup) {
  Node node(Arguments());
  grpc::ClientContext context;
  const auto stub = v1::BackupService::NewStub(node.channel());
  const auto reader = stub->DownloadBackup(&context, v1::DownloadBackupRequest());
  v1::DownloadBackupResponse part;
  EXPECT_FALSE(reader->Read(&part));
  const grpc::Status refused = reader->Finish();
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(refused.error_message(), HasSubstr("pg_basebackup"));
}

TEST_F(PostgresTest, AcknowledgesNothingWhileTheDatabaseIsAwayAndGoesOnAfterwards) {
  Node node(Arguments());
  ASSERT_TRUE(node.Create("rig").ok());
  ASSERT_TRUE(node.Add(1).ok());
  server_.Crash();
  EXPECT_EQ(node.Add(2).error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(node.Create("other").error_code(), grpc::StatusCode::UNAVAILABLE);
  server_.Start();
  const grpc::Status added = Insist([&] { return node.Add(2); });
  EXPECT_TRUE(added.ok()) << added.error_message();
  EXPECT_EQ(Batches(), 2);
  EXPECT_EQ(EstimateAt(node), Undisturbed(2));
}

TEST_F(PostgresTest, NamesTheOwnerToClientsOfAnotherDaemon) {
  Node first(Arguments()), second(Arguments());
  ASSERT_TRUE(first.Create("rig").ok());
  ASSERT_TRUE(second.Create("other").ok());
  ASSERT_TRUE(first.Add(1).ok());
  EXPECT_THAT(second.Names(), ElementsAre("sessions/other", "sessions/rig"));
  EXPECT_EQ(second.Create("rig").error_code(), grpc::StatusCode::ALREADY_EXISTS);
  const grpc::Status refused = second.Add(2);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(refused.error_message(), HasSubstr(first.address()));
  rpc::Status details;
  ASSERT_TRUE(details.ParseFromString(refused.error_details()));
  rpc::ErrorInfo info;
  ASSERT_TRUE(info.ParseFromString(details.details(0).value()));
  EXPECT_EQ(info.reason(), "OWNED_ELSEWHERE");
  EXPECT_EQ(info.metadata().at("owner"), first.address());
  ClientStream stream(second.sessions());
  stream.Send("sessions/rig", 2, BatchOf(2));
  v1::StreamMeasurementsResponse response;
  EXPECT_FALSE(stream.Read(response));
  EXPECT_EQ(stream.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  ASSERT_TRUE(first.Delete("sessions/rig").ok());
  EXPECT_EQ(second.Add(2).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_TRUE(second.Create("rig").ok());
  EXPECT_EQ(first.Add(1).error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(PostgresTest, GivesTheSessionsOfADeadDaemonToAnotherToTheSameBits) {
  auto first = std::make_unique<Node>(Arguments());
  Node second(Arguments());
  ASSERT_TRUE(first->Create("rig").ok());
  for (const int number : {1, 2}) ASSERT_TRUE(first->Add(number).ok());
  first->process().Signal(SIGKILL);
  first->process().Wait();
  const grpc::Status added = Insist([&] { return second.Add(3); });
  EXPECT_TRUE(added.ok()) << added.error_message();
  EXPECT_EQ(EstimateAt(second), Undisturbed(3));
}

TEST_F(PostgresTest, LetsADaemonThatWasStoppedPastItsLeaseWriteNothing) {
  Node first(Arguments()), second(Arguments());
  ASSERT_TRUE(first.Create("rig").ok());
  ClientStream stream(first.sessions());
  stream.Send("sessions/rig", 1, BatchOf(1));
  stream.ExpectAcknowledgement(1);
  first.process().Signal(SIGSTOP);
  // Until the last of its threads has stopped, it could still send a batch to the database.
  siginfo_t stopped;
  ASSERT_EQ(waitid(P_PID, static_cast<id_t>(first.process().pid()), &stopped, WSTOPPED), 0);
  // The batch waits in the socket of the daemon, whose stream is open.
  stream.Send("sessions/rig", 2, BatchOf(2));
  v1::Estimate estimate;
  ASSERT_TRUE(Insist([&] { return second.Estimate(estimate); }).ok());
  first.process().Signal(SIGCONT);
  v1::StreamMeasurementsResponse response;
  while (stream.Read(response)) {
    EXPECT_NE(response.acknowledgement().sequence(), 2) << response.ShortDebugString();
  }
  const grpc::Status ended = stream.Finish();
  EXPECT_EQ(ended.error_code(), grpc::StatusCode::UNAVAILABLE) << ended.error_message();
  EXPECT_EQ(Batches(), 1);
  const grpc::Status refused = first.Add(2);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAVAILABLE) << refused.error_message();
  const grpc::Status added = second.Add(2);
  EXPECT_TRUE(added.ok()) << added.error_message();
  EXPECT_EQ(EstimateAt(second), Undisturbed(2));
}

}  // namespace
}  // namespace polyest::internal
