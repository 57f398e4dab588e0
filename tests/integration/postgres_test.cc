// Tests daemons whose sessions are in a PostgreSQL database, one daemon and several.

#include <signal.h>
#include <sys/wait.h>

#include "polyest/rpc/error_details.pb.h"
#include "polyest/v1/backup_service.grpc.pb.h"
#include "tests/integration/postgres_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

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
  const grpc::Status added = second.Add(2);
  EXPECT_TRUE(added.ok()) << added.error_message();
  EXPECT_EQ(EstimateAt(second), Undisturbed(2));
  second.process().Signal(SIGTERM);
  EXPECT_EQ(second.process().Wait(), 0);
  // The first one has the session in memory still, as it was.
  v1::Session session;
  const grpc::Status got = Insist([&] { return first.Get(session); });
  EXPECT_TRUE(got.ok()) << got.error_message();
  EXPECT_EQ(session.last_sequence(), 2);
  EXPECT_EQ(EstimateAt(first), Undisturbed(2));
}

}  // namespace
}  // namespace polyest::internal
