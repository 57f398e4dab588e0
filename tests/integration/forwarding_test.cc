// Tests that any daemon of a database answers calls about sessions of another.

#include <signal.h>

#include "tests/integration/forwarding_fixture.h"

namespace polyest::internal {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

TEST_F(ForwardingTest, AnswersAtAnyDaemonToTheSameBits) {
  Node owner(Sharing()), other(Sharing());
  ASSERT_TRUE(owner.Create("rig").ok());
  for (const int number : {1, 2, 3}) {
    const grpc::Status added = other.Add(number);
    ASSERT_TRUE(added.ok()) << added.error_message();
  }
  EXPECT_EQ(EstimateAt(other), EstimateAt(owner));
  EXPECT_EQ(EstimateAt(other), Undisturbed(3));
  for (const std::string& method : AllMethods()) {
    if (method == "GetSession" || method == "DeleteSession" || method == "WatchSession") continue;
    SCOPED_TRACE(method);
    const auto request = AboutTheRig(method);
    if (!request) continue;
    std::string there, here;
    const grpc::Status at_owner =
        CallRaw(owner.channel(), MethodPath(method), "", *request, &there);
    const grpc::Status passed_on =
        CallRaw(other.channel(), MethodPath(method), "", *request, &here);
    EXPECT_EQ(passed_on.error_code(), at_owner.error_code()) << passed_on.error_message();
    EXPECT_EQ(passed_on.error_message(), at_owner.error_message());
    EXPECT_EQ(passed_on.error_details(), at_owner.error_details());
    EXPECT_EQ(here, there);
  }
  v1::Session session;
  ASSERT_TRUE(other.Get(session).ok());
  EXPECT_EQ(session.last_sequence(), 3);
  EXPECT_TRUE(session.activity().loaded());
  EXPECT_TRUE(other.Delete("sessions/rig").ok());
  EXPECT_EQ(owner.Get(session).error_code(), StatusCode::NOT_FOUND);
}

TEST_F(ForwardingTest, PassesStreamsAndWatchesOn) {
  Node owner(Sharing()), other(Sharing());
  ASSERT_TRUE(owner.Create("rig").ok());
  WatchOf watch(other.sessions(), "sessions/rig");
  ClientStream stream(other.sessions());
  const auto last_only = [](v1::StreamMeasurementsRequest& request) {
    request.mutable_estimates()->set_only_last(true);
  };
  for (const int number : {1, 2, 3}) {
    ASSERT_TRUE(stream.Send("sessions/rig", number, BatchOf(number), last_only));
    stream.ExpectAcknowledgement(number);
  }
  stream.HalfClose();
  v1::Estimate estimate;
  stream.ExpectEstimate(estimate);
  EXPECT_TRUE(stream.Finish().ok());
  EXPECT_EQ(WithoutSequence(estimate), Undisturbed(3));
  EXPECT_EQ(watch.ReadTo(3), 3);
  ASSERT_TRUE(owner.Add(4).ok());
  EXPECT_EQ(watch.ReadTo(4), 4);
  ClientStream gap(other.sessions());
  gap.Send("sessions/rig", 9, BatchOf(9));
  v1::StreamMeasurementsResponse response;
  EXPECT_FALSE(gap.Read(response));
  EXPECT_EQ(gap.Finish().error_code(), StatusCode::FAILED_PRECONDITION);
  ASSERT_TRUE(owner.Delete("sessions/rig").ok());
  EXPECT_EQ(watch.ReadTo(5), 0);
  EXPECT_EQ(watch.Finish().error_code(), StatusCode::NOT_FOUND);
}

TEST_F(ForwardingTest, EndsTheOwnersCallWhenTheClientCancels) {
  Node owner(Sharing()), other(Sharing());
  ASSERT_TRUE(owner.Create("rig").ok());
  ASSERT_TRUE(owner.Add(1).ok());
  WatchOf watch(other.sessions(), "sessions/rig");
  EXPECT_EQ(watch.Next(), 1);
  v1::Session session;
  while (session.activity().watcher_count() < 1) ASSERT_TRUE(owner.Get(session).ok());
  watch.Cancel();
  EXPECT_EQ(watch.ReadTo(2), 0);
  while (session.activity().watcher_count() > 0) ASSERT_TRUE(owner.Get(session).ok());
}

TEST_F(ForwardingTest, GoesOnElsewhereWhenTheOwnerOfAStreamIsKilled) {
  auto owner = std::make_unique<Node>(Sharing());
  Node other(Sharing());
  ASSERT_TRUE(owner->Create("rig").ok());
  ClientStream stream(other.sessions());
  for (const int number : {1, 2}) {
    ASSERT_TRUE(stream.Send("sessions/rig", number, BatchOf(number)));
  }
  // Whatever has come back when the owner dies has been kept.
  v1::StreamMeasurementsResponse response;
  int64_t acknowledged = 0;
  while (acknowledged < 1) {
    ASSERT_TRUE(stream.Read(response));
    acknowledged = std::max(acknowledged, response.acknowledgement().sequence());
  }
  owner->process().Signal(SIGKILL);
  owner->process().Wait();
  while (stream.Read(response)) {
    acknowledged = std::max(acknowledged, response.acknowledgement().sequence());
  }
  const grpc::Status ended = stream.Finish();
  EXPECT_EQ(ended.error_code(), StatusCode::UNAVAILABLE) << ended.error_message();
  v1::Session session;
  const grpc::Status found = Insist([&] { return other.Get(session); });
  ASSERT_TRUE(found.ok()) << found.error_message();
  EXPECT_GE(session.last_sequence(), acknowledged);
  for (int64_t number = acknowledged + 1; number <= 4; ++number) {
    const grpc::Status added = Insist([&] { return other.Add(static_cast<int>(number)); });
    ASSERT_TRUE(added.ok()) << added.error_message();
  }
  EXPECT_EQ(Batches(), 4);
  EXPECT_EQ(EstimateAt(other), Undisturbed(4));
}

TEST_F(ForwardingTest, NoticesAnOwnerThatStandsStill) {
  Node owner(Sharing()), other(Sharing());
  ASSERT_TRUE(owner.Create("rig").ok());
  ASSERT_TRUE(owner.Add(1).ok());
  WatchOf watch(other.sessions(), "sessions/rig", std::chrono::seconds(20));
  EXPECT_EQ(watch.ReadTo(1), 1);
  owner.process().Signal(SIGSTOP);
  EXPECT_EQ(watch.ReadTo(2), 0);
  const grpc::Status ended = watch.Finish();
  EXPECT_EQ(ended.error_code(), StatusCode::UNAVAILABLE) << ended.error_message();
  owner.process().Signal(SIGCONT);
}

TEST_F(ForwardingTest, EndsPassedOnStreamsInOrderWhenItStops) {
  Node owner(Sharing());
  auto other = std::make_unique<Node>(Sharing());
  ASSERT_TRUE(owner.Create("rig").ok());
  ClientStream stream(other->sessions());
  const auto last_only = [](v1::StreamMeasurementsRequest& request) {
    request.mutable_estimates()->set_only_last(true);
  };
  ASSERT_TRUE(stream.Send("sessions/rig", 1, BatchOf(1), last_only));
  stream.ExpectAcknowledgement(1);
  WatchOf watch(other->sessions(), "sessions/rig");
  other->process().Signal(SIGTERM);
  v1::Estimate estimate;
  stream.ExpectEstimate(estimate);
  EXPECT_EQ(estimate.sequence(), 1);
  const grpc::Status ended = stream.Finish();
  EXPECT_EQ(ended.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(InfoOf(ended).reason(), "SHUTTING_DOWN");
  EXPECT_EQ(watch.ReadTo(2), 0);
  EXPECT_EQ(watch.Finish().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(other->process().Wait(), 0);
}

TEST_F(ForwardingTest, PassesNoCallOnTwice) {
  Node second(Sharing());
  // Says that it is reached where the other one is.
  Node first(Sharing({"--advertise", second.address()}));
  ASSERT_TRUE(first.Create("rig").ok());
  const grpc::Status refused = second.Add(1);
  EXPECT_EQ(refused.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(InfoOf(refused).reason(), "OWNED_ELSEWHERE");
  ClientStream stream(second.sessions());
  stream.Send("sessions/rig", 1, BatchOf(1));
  v1::StreamMeasurementsResponse response;
  EXPECT_FALSE(stream.Read(response));
  EXPECT_EQ(InfoOf(stream.Finish()).reason(), "OWNED_ELSEWHERE");
  EXPECT_TRUE(first.Add(1).ok());
}

TEST_F(ForwardingTest, NamesAnOwnerThatItCannotReach) {
  Node first(Sharing({"--advertise", "127.0.0.1:1"})), second(Sharing());
  ASSERT_TRUE(first.Create("rig").ok());
  const grpc::Status refused = second.Add(1);
  EXPECT_EQ(refused.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_THAT(refused.error_message(),
              HasSubstr("127.0.0.1:1, to which the call was passed on, is not"));
  EXPECT_EQ(InfoOf(refused).metadata().at("owner"), "127.0.0.1:1");
}

TEST_F(ForwardingTest, GivesNewSessionsToTheDaemonWithLessToDo) {
  Node first(Sharing()), second(Sharing());
  for (int i = 1; i <= 24; ++i) {
    const std::string id = "rig-" + std::to_string(i);
    const grpc::Status created = first.Create(id);
    ASSERT_TRUE(created.ok()) << created.error_message();
    ASSERT_TRUE(first.Add(1, "sessions/" + id).ok());
  }
  const std::string least =
      "SELECT min(sessions) FROM (SELECT count(owner.session) AS sessions FROM polyest.node LEFT "
      "JOIN polyest.owner ON owner.node = node.node GROUP BY node.node) AS counted";
  EXPECT_GE(server_.Number(uri_, least), 6);
  EXPECT_EQ(second.Names().size(), 24u);
  EXPECT_EQ(first.Create("rig-20").error_code(), StatusCode::ALREADY_EXISTS);
}

TEST_F(ForwardingTest, TakesNewSessionsItselfThatAnotherDaemonDoesNotTake) {
  Node first(Sharing()), second(Sharing({"--advertise", "127.0.0.1:1"}));
  for (int i = 1; i <= 12; ++i) {
    const grpc::Status created = first.Create("rig-" + std::to_string(i));
    ASSERT_TRUE(created.ok()) << created.error_message();
  }
}

TEST_F(ForwardingTest, BelievesNobodyWithoutTheSecret) {
  Node owner(Sharing()), stranger(Arguments());
  const auto refuse = [](Node& node, const std::string& secret) {
    grpc::ClientContext context;
    context.AddMetadata("x-polyest-node-secret", secret);
    context.AddMetadata("x-polyest-node-peer", "ipv4:192.0.2.7:1");
    v1::ListSessionsResponse response;
    return node.sessions().ListSessions(&context, v1::ListSessionsRequest(), &response);
  };
  EXPECT_EQ(refuse(owner, std::string(32, 'x')).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(refuse(stranger, std::string(32, 's')).error_code(), StatusCode::UNAUTHENTICATED);
  const grpc::Status believed = refuse(owner, std::string(32, 's'));
  EXPECT_TRUE(believed.ok()) << believed.error_message();
}

// Two daemons with TLS, client certificates and tokens.
class SecureForwardingTest : public ForwardingTest {
 protected:
  std::vector<std::string> Secured() const {
    return Sharing({"--tokens", tokens_, "--tls-certificate", certificate_, "--tls-key", key_,
                    "--tls-client-ca", ca_, "--node-ca", ca_, "--log-format", "json", "--log-level",
                    "debug"});
  }
  std::shared_ptr<grpc::ChannelCredentials> Credentials() const {
    const IssuedCertificate own = authority_.Issue("rig");
    return grpc::SslCredentials({authority_.certificate(), own.key, own.certificate});
  }

  const CertificateAuthority authority_{"test CA"};
  const IssuedCertificate daemon_ = authority_.Issue("daemon");
  const NewToken reader_ = *MakeTokenFor("anna:chassis:reader");
  const NewToken writer_ = *MakeTokenFor("rig1:chassis:writer");
  const NewToken admin_ = *MakeTokenFor("bert:chassis:admin");
  const NewToken other_ = *MakeTokenFor("carl:engines:admin");
  const std::string ca_ = folder_.Write("ca.pem", authority_.certificate());
  const std::string certificate_ = folder_.Write("daemon.pem", daemon_.certificate);
  const std::string key_ = folder_.Write("daemon.key", daemon_.key);
  const std::string tokens_ = folder_.Write("tokens", reader_.line + "\n" + writer_.line + "\n" +
                                                          admin_.line + "\n" + other_.line + "\n");
};

TEST_F(SecureForwardingTest, AnswersEveryCallerAsTheOwnerDoes) {
  Node owner(Secured(), "127.0.0.1:0", Credentials()),
      other(Secured(), "127.0.0.1:0", Credentials());
  v1::CreateSessionRequest create;
  create.set_session_id("rig");
  *create.mutable_session()->mutable_problem() = Oscillator();
  const grpc::Status created = CallRaw(owner.channel(), MethodPath("CreateSession"), writer_.secret,
                                       create.SerializeAsString());
  ASSERT_TRUE(created.ok()) << created.error_message();
  for (const std::string& token : {reader_.secret, std::string(), other_.secret, MakeToken()}) {
    for (const std::string& method : AllMethods()) {
      SCOPED_TRACE(method);
      const auto request = AboutTheRig(method);
      if (!request || (method == "WatchSession" && token == reader_.secret)) continue;
      const auto there = CallRaw(owner.channel(), MethodPath(method), token, *request);
      const auto here = CallRaw(other.channel(), MethodPath(method), token, *request);
      EXPECT_EQ(here.error_code(), there.error_code()) << here.error_message();
      EXPECT_EQ(here.error_message(), there.error_message());
      EXPECT_EQ(here.error_details(), there.error_details());
    }
  }
  std::string answer;
  const grpc::Status deleted = CallRaw(other.channel(), MethodPath("DeleteSession"), admin_.secret,
                                       *AboutTheRig("DeleteSession"), &answer);
  EXPECT_TRUE(deleted.ok()) << deleted.error_message();
}

TEST_F(SecureForwardingTest, LogsTheClientAndItsRequestAtTheOwner) {
  Node owner(Secured(), "127.0.0.1:0", Credentials()),
      other(Secured(), "127.0.0.1:0", Credentials());
  v1::CreateSessionRequest create;
  create.set_session_id("rig");
  *create.mutable_session()->mutable_problem() = Oscillator();
  ASSERT_TRUE(CallRaw(owner.channel(), MethodPath("CreateSession"), writer_.secret,
                      create.SerializeAsString())
                  .ok());
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + admin_.secret);
  context.AddMetadata("x-request-id", "request-7");
  v1::DeleteSessionRequest request;
  request.set_name("sessions/rig");
  google::protobuf::Empty empty;
  ASSERT_TRUE(other.sessions().DeleteSession(&context, request, &empty).ok());
  owner.process().Signal(SIGTERM);
  EXPECT_EQ(owner.process().Wait(), 0);
  const std::string log = owner.process().Errors();
  const size_t line = log.find("request-7");
  ASSERT_NE(line, std::string::npos) << log;
  EXPECT_THAT(log.substr(line, log.find('\n', line) - line), HasSubstr("\"caller\":\"bert\""));
}

}  // namespace
}  // namespace polyest::internal
