// Tests who may call the HTTP port, and from which pages.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <optional>

#include "server/security/token_table.h"
#include "tests/integration/operations_fixture.h"
#include "tests/integration/web_fixture.h"
#include "tests/testing/certificates.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

httplib::Headers Bearer(const std::string& secret) {
  return {{"Authorization", "Bearer " + secret}};
}

class WebTokensTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_.Write("tokens", reader_.line + "\n" + writer_.line + "\n" + other_.line + "\n");
    daemon_.emplace(std::vector<std::string>{"--listen", "127.0.0.1:0", "--web", "127.0.0.1:0",
                                             "--tokens", folder_ / "tokens"});
    ASSERT_FALSE(daemon_->ReadAddress().empty()) << daemon_->Errors();
    web_.emplace(daemon_->ReadLine());
  }

  const NewToken reader_ = *MakeTokenFor("anna:chassis:reader");
  const NewToken writer_ = *MakeTokenFor("rig1:chassis:writer");
  const NewToken other_ = *MakeTokenFor("carl:engines:admin");
  const TestFolder folder_;
  std::optional<DaemonProcess> daemon_;
  std::optional<WebClientOfTest> web_;
};

TEST_F(WebTokensTest, AreNeededForCallsAndNotForThePage) {
  EXPECT_EQ(web_->Get("/").status, 200);
  for (const httplib::Headers& headers :
       {httplib::Headers{}, Bearer("polyest_" + std::string(64, '0')), Bearer(""),
        httplib::Headers{{"Authorization", "Basic YTpi"}},
        httplib::Headers{{"Authorization", "Bearer " + reader_.secret},
                         {"Authorization", "Bearer " + reader_.secret}}}) {
    const WebAnswer answer = web_->Post("SessionService/ListSessions", "{}", headers);
    EXPECT_EQ(answer.status, 401);
    EXPECT_EQ(answer.Code(), grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(answer.Header("WWW-Authenticate"), "Bearer");
  }
  EXPECT_EQ(web_->Post("SessionService/ListSessions", "{}", Bearer(reader_.secret)).status, 200);
  EXPECT_THAT(daemon_->Errors(), HasSubstr("code=UNAUTHENTICATED"));
  EXPECT_THAT(daemon_->Errors(), Not(HasSubstr(reader_.secret)));
}

TEST_F(WebTokensTest, AllowWhatTheirRoleMayAndShowTheirTenantsSessionsOnly) {
  const std::string create =
      R"({"sessionId": "rig", "session": {"problem": )" + ToJson(Oscillator(), false) + "}}";
  const WebAnswer refused =
      web_->Post("SessionService/CreateSession", create, Bearer(reader_.secret));
  EXPECT_EQ(refused.status, 403);
  EXPECT_EQ(refused.Code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(refused.Message(), HasSubstr("needs the role writer"));
  EXPECT_EQ(web_->Post("SessionService/CreateSession", create, Bearer(writer_.secret)).status, 200);
  const std::string name = R"({"name": "sessions/rig"})";
  EXPECT_EQ(web_->Post("SessionService/GetSession", name, Bearer(reader_.secret)).status, 200);
  EXPECT_EQ(web_->Post("SessionService/GetSession", name, Bearer(other_.secret)).status, 404);
}

// The watch of the session that its token could see before is still open when another asks alike.
TEST_F(WebTokensTest, ShareNoWatchWithATenantThatTheyHaveLeft) {
  const std::string create =
      R"({"sessionId": "rig", "session": {"problem": )" + ToJson(Oscillator(), false) + "}}";
  const std::string rig = R"({"session": "sessions/rig"})";
  ASSERT_EQ(web_->Post("SessionService/CreateSession", create, Bearer(writer_.secret)).status, 200);
  v1::AddMeasurementsRequest rows;
  rows.set_session("sessions/rig");
  rows.set_sequence(1);
  *rows.mutable_measurements() = OscillatorRows(0, 5);
  ASSERT_EQ(
      web_->Post("SessionService/AddMeasurements", ToJson(rows, false), Bearer(writer_.secret))
          .status,
      200);
  // The caller of the first event has another tenant from then on.
  std::string moved = reader_.line;
  moved.replace(moved.find("chassis"), std::string("chassis").size(), "engines");
  const auto watching = [&](const httplib::Headers& headers, WebClientOfTest& client,
                            const std::function<bool(const WebEvent&)>& take) {
    return client.Stream("SessionService/WatchSession", rig, take, headers);
  };
  int status = 0;
  const WebAnswer first = watching(Bearer(reader_.secret), *web_, [&](const WebEvent& event) {
    EXPECT_EQ(SequenceOf(event), 1);
    folder_.Write("tokens", moved + "\n" + writer_.line + "\n");
    daemon_->Signal(SIGHUP);
    const std::string own = R"({"name": "sessions/rig"})";
    WebClientOfTest other("web page on " + web_->address() + "/");
    while (other.Post("SessionService/GetSession", own, Bearer(reader_.secret)).status == 200) {
    }
    status = watching(Bearer(reader_.secret), other, [](const WebEvent& seen) {
               ADD_FAILURE() << seen.data;
               return false;
             }).status;
    return false;
  });
  EXPECT_EQ(first.status, 200);
  EXPECT_EQ(status, 404);
}

// What is sent by those who have no token is not even read.
TEST_F(WebTokensTest, AreAskedForBeforeTheBody) {
  const auto answer =
      web_->client().Post("/v1/SessionService/ListSessions", {{"Expect", "100-continue"}},
                          "not JSON", "application/json");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 401);
}

class WebOriginTest : public WebTest {
 protected:
  WebOriginTest() : WebTest({"--web-host", "rig.example.org", "--metrics", "127.0.0.1:0"}) {}
  void SetUp() override {
    DaemonTest::SetUp();
    metrics_port_ = PortOf(daemon_.ReadLine());
    web_ = std::make_unique<WebClientOfTest>(daemon_.ReadLine());
  }
  int metrics_port_ = 0;
};

TEST_F(WebOriginTest, IsThatOfThePageItself) {
  const auto list = [&](const httplib::Headers& headers) {
    return web_->Post("SessionService/ListSessions", "{}", headers).status;
  };
  EXPECT_EQ(list({{"Origin", web_->address()}}), 200);
  EXPECT_EQ(list({{"Host", "rig.example.org"}, {"Origin", "https://rig.example.org"}}), 200);
  EXPECT_EQ(list({{"Origin", "https://evil.example"}}), 403);
  EXPECT_EQ(list({{"Origin", "null"}}), 403);
  EXPECT_EQ(list({{"Host", "evil.example"}}), 403);
  EXPECT_EQ(list({{"Host", "evil.example"}, {"Origin", "http://evil.example"}}), 403);
  EXPECT_EQ(web_->Get("/", {{"Host", "evil.example"}}).status, 403);
  EXPECT_THAT(daemon_.Errors(), HasSubstr("reason=\"the daemon does not go by this Host;"));
  const std::string metrics = Scrape(metrics_port_);
  EXPECT_THAT(metrics, HasSubstr("polyest_web_requests_total{code=\"200\"} 2"));
  EXPECT_THAT(metrics, HasSubstr("polyest_web_requests_total{code=\"403\"} 5"));
}

TEST_F(WebOriginTest, IsAllowedToNoOtherPage) {
  const auto preflight = web_->client().Options(
      "/v1/SessionService/ListSessions", {{"Origin", "https://evil.example"},
                                          {"Access-Control-Request-Method", "POST"},
                                          {"Access-Control-Request-Headers", "content-type"}});
  ASSERT_TRUE(preflight);
  EXPECT_EQ(preflight->status, 403);
  for (const auto& [name, value] : preflight->headers) {
    EXPECT_FALSE(name.starts_with("Access-Control")) << name;
  }
  const WebAnswer page = web_->Get("/");
  EXPECT_EQ(page.Header("X-Content-Type-Options"), "nosniff");
  EXPECT_THAT(page.Header("Content-Security-Policy"), HasSubstr("default-src 'none'"));
  EXPECT_THAT(page.Header("Content-Type"), HasSubstr("text/html"));
}

TEST_F(WebOriginTest, IsServedAfterWhateverBytesHaveCome) {
  std::string bytes;
  for (uint32_t i = 0, state = 1; i < 20'000; ++i) {
    state = state * 1'664'525 + 1'013'904'223;
    bytes += static_cast<char>(state >> 24);
  }
  for (size_t from = 0; from < bytes.size(); from += 1'000) {
    const int client = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(web_->port()));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(connect(client, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    const std::string text = "\r\n\r\n" + bytes.substr(from, 1'000) + "\r\n\r\n";
    (void)!send(client, text.data(), text.size(), MSG_NOSIGNAL);
    shutdown(client, SHUT_WR);
    char answer[1'024];
    while (recv(client, answer, sizeof(answer), 0) > 0) {
    }
    close(client);
  }
  EXPECT_EQ(web_->Post("SessionService/ListSessions", "{}").status, 200);
}

// Returns what a daemon says that does not start.
std::string Refused(std::vector<std::string> arguments, int status) {
  arguments.insert(arguments.begin(), {"--listen", "127.0.0.1:0"});
  DaemonProcess daemon(arguments);
  EXPECT_EQ(daemon.ReadLine(), "");
  EXPECT_EQ(daemon.Wait(), status);
  return daemon.Errors();
}

TEST(WebAddress, IsNotBeyondLoopbackWithoutEncryptionAndAuthentication) {
  EXPECT_THAT(Refused({"--web", "0.0.0.0:0"}, 2), HasSubstr("--web: 0.0.0.0 is beyond loopback"));
  EXPECT_THAT(Refused({"--web", "127.0.0.1"}, 2), HasSubstr("--web: \"127.0.0.1\" must be"));
  EXPECT_THAT(Refused({"--web-host", "rig"}, 2), HasSubstr("--web-host: needs --web"));
  EXPECT_THAT(Refused({"--web", "127.0.0.1:0", "--web-host", "http://rig"}, 2),
              HasSubstr("must be a host without a port"));
  DaemonProcess insecure({"--listen", "127.0.0.1:0", "--insecure", "--web", "0.0.0.0:0"});
  ASSERT_FALSE(insecure.ReadAddress().empty());
  EXPECT_THAT(insecure.ReadLine(), HasSubstr("web page on http://0.0.0.0:"));
}

TEST(WebAddress, IsNotSharedWithAnotherDaemon) {
  DaemonProcess first({"--listen", "127.0.0.1:0", "--web", "127.0.0.1:0"});
  ASSERT_FALSE(first.ReadAddress().empty());
  const WebClientOfTest web(first.ReadLine());
  EXPECT_THAT(Refused({"--web", web.authority()}, 1),
              HasSubstr("--web: cannot listen on " + web.authority() + ": the port is in use"));
}

TEST(WebEncryption, IsThatOfGrpcWithItsClientCertificates) {
  const CertificateAuthority authority("test CA");
  const TestFolder folder;
  const auto install = [&](const std::string& name) {
    const IssuedCertificate issued = authority.Issue(name);
    folder.Write(name + ".pem", issued.certificate);
    folder.Write(name + ".key", issued.key);
  };
  install("daemon");
  install("rig");
  folder.Write("ca.pem", authority.certificate());
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--web", "127.0.0.1:0", "--tls-certificate",
                        folder / "daemon.pem", "--tls-key", folder / "daemon.key",
                        "--tls-client-ca", folder / "ca.pem", "--log-level", "debug"});
  ASSERT_FALSE(daemon.ReadAddress().empty()) << daemon.Errors();
  const WebClientOfTest web(daemon.ReadLine());
  ASSERT_TRUE(web.address().starts_with("https://127.0.0.1:"));
  const std::string method = "/v1/SessionService/ListSessions";

  httplib::SSLClient known("localhost", web.port(), folder / "rig.pem", folder / "rig.key");
  // As browsers do, it offers protocols, of which HTTP/1.1 is chosen.
  const std::string offered = "\x02h2\x08http/1.1";
  ASSERT_EQ(SSL_CTX_set_alpn_protos(known.ssl_context(),
                                    reinterpret_cast<const unsigned char*>(offered.data()),
                                    static_cast<unsigned>(offered.size())),
            0);
  known.set_ca_cert_path((folder / "ca.pem").c_str());
  const auto answer = known.Post(method, "{}", "application/json");
  ASSERT_TRUE(answer) << httplib::to_string(answer.error());
  EXPECT_EQ(answer->status, 200);
  // The log names the holder of the certificate, as for a call by gRPC.
  EXPECT_THAT(daemon.Errors(), HasSubstr("caller=rig peer=ipv4:127.0.0.1:"));

  httplib::SSLClient stranger("localhost", web.port());
  stranger.set_ca_cert_path((folder / "ca.pem").c_str());
  EXPECT_FALSE(stranger.Post(method, "{}", "application/json"));
  httplib::Client plain("127.0.0.1", web.port());
  EXPECT_FALSE(plain.Post(method, "{}", "application/json"));
}

}  // namespace
}  // namespace polyest::internal
