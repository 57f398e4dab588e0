#include <gmock/gmock.h>
#include <stdlib.h>

#include "polyest/client.h"
#include "server/security/token_table.h"
#include "tests/integration/cli/command_test.h"
#include "tests/testing/certificates.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

class SecurityTest : public CommandTest {
 protected:
  SecurityTest() : authority_("test CA") {
    const IssuedCertificate issued = authority_.Issue("daemon");
    certificate_ = File("daemon.pem", issued.certificate);
    key_ = File("daemon.key", issued.key);
    ca_ = File("ca.pem", authority_.certificate());
    tokens_ = File("tokens", reader_.line + "\n" + writer_.line + "\n");
    reader_file_ = File("reader.token", reader_.secret + "\n");
    writer_file_ = File("writer.token", writer_.secret + "\n");
  }
  ~SecurityTest() override { unsetenv("POLYEST_TOKEN"); }

  std::vector<std::string> WithTls() const {
    return {"--tls-certificate", certificate_, "--tls-key", key_, "--tokens", tokens_};
  }

  // Checks the exit status of a failed command and returns its one line of stderr.
  static std::string OneLine(const Finished& finished, int exit_status) {
    EXPECT_EQ(finished.exit_status, exit_status) << finished.err;
    EXPECT_EQ(finished.out, "");
    EXPECT_THAT(Lines(finished.err), SizeIs(1));
    return finished.err;
  }

  const CertificateAuthority authority_;
  const NewToken reader_ = *MakeTokenFor("anna:chassis:reader");
  const NewToken writer_ = *MakeTokenFor("rig1:chassis:writer");
  std::string certificate_, key_, ca_, tokens_, reader_file_, writer_file_;
};

TEST_F(SecurityTest, StreamsOverTlsWithAToken) {
  DaemonProcess daemon(WithTls());
  const Finished stream =
      Run({"stream", Example("oscillator.json"), File("d.csv", DemoRows(40)), "--server",
           daemon.address(), "--tls-ca", ca_, "--token-file", writer_file_, "--format", "jsonl"});
  EXPECT_EQ(stream.exit_status, 0) << stream.err;
  EXPECT_EQ(ParseEstimate(Lines(stream.out).back()).samples(), 40);
}

TEST_F(SecurityTest, TakesTheTokenOfTheOptionBeforeThatOfTheEnvironment) {
  DaemonProcess daemon({"--tokens", tokens_});
  setenv("POLYEST_TOKEN_FILE", File("stale.token", "polyest_stale\n").c_str(), 1);
  const Finished stale = Run({"models", "--server", daemon.address()});
  const Finished given =
      Run({"models", "--server", daemon.address(), "--token-file", reader_file_});
  unsetenv("POLYEST_TOKEN_FILE");
  EXPECT_EQ(stale.exit_status, 3);
  EXPECT_EQ(given.exit_status, 0) << given.err;
}

TEST_F(SecurityTest, GoesOnWithATokenThatWasRotatedUnderAStream) {
  DaemonProcess daemon({"--tokens", tokens_});
  Process process({POLYEST_PROGRAM, "stream", Example("oscillator.json"), "-", "--server",
                   daemon.address(), "--token-file", writer_file_, "--batch", "30", "--format",
                   "jsonl"});
  process.Write(DemoRows(30));
  EXPECT_THAT(process.ReadLine(), HasSubstr("\"sequence\":\"1\""));
  // The token is rotated as in the runbook, but without the time in which both tokens are valid.
  const NewToken rotated = *MakeTokenFor("rig1:chassis:writer");
  File("writer.token", rotated.secret + "\n");
  File("tokens", reader_.line + "\n" + rotated.line + "\n");
  Client client(daemon.address(), {.token_file = writer_file_});
  while (!client.GetStatus({}).ok()) {
  }
  process.Write(DemoRows(60).substr(DemoRows(30).size()));
  process.CloseInput();
  EXPECT_THAT(process.ReadAll(), HasSubstr("\"sequence\":\"2\""));
  EXPECT_EQ(process.Wait(), 0) << process.Errors();
  EXPECT_THAT(process.Errors(), HasSubstr("the token is no longer valid; a new one is available"));
}

TEST_F(SecurityTest, TakesTheTokenFromTheEnvironment) {
  DaemonProcess daemon({"--tokens", tokens_});
  setenv("POLYEST_TOKEN", reader_.secret.c_str(), 1);
  EXPECT_EQ(Run({"models", "--server", daemon.address()}).exit_status, 0);
  setenv("POLYEST_TOKEN", "wrong", 1);
  EXPECT_EQ(Run({"models", "--server", daemon.address(), "--token-file", reader_file_}).exit_status,
            0);
}

TEST_F(SecurityTest, SaysInOneLineWhatWasRefused) {
  DaemonProcess daemon({"--tokens", tokens_});
  const std::string at = "polyest: server " + daemon.address() + ": ";
  EXPECT_EQ(OneLine(Run({"models", "--server", daemon.address()}), 3), at + "a token is needed\n");
  EXPECT_EQ(OneLine(Run({"models", "--server", daemon.address(), "--token-file",
                         File("wrong.token", MakeToken())}),
                    3),
            at + "the token is not known\n");
  EXPECT_EQ(OneLine(Run({"stream", Example("oscillator.json"), Example("oscillator.csv"),
                         "--server", daemon.address(), "--token-file", reader_file_}),
                    3),
            at + "CreateSession needs the role writer, the token has reader\n");
}

TEST_F(SecurityTest, SendsNoTokenOverANetworkWithoutTls) {
  EXPECT_EQ(
      OneLine(Run({"models", "--server", "rig.example.org:50051", "--token-file", reader_file_}),
              2),
      "polyest: token: rig.example.org:50051 is not a loopback address; tokens are sent only "
      "over TLS (--tls-ca)\n");
}

TEST_F(SecurityTest, RefusesADaemonThatItsCaDoesNotKnow) {
  DaemonProcess daemon(WithTls());
  const std::string other = File("other.pem", CertificateAuthority("another CA").certificate());
  EXPECT_THAT(OneLine(Run({"models", "--server", daemon.address(), "--tls-ca", other,
                           "--token-file", reader_file_}),
                      3),
              StartsWith("polyest: server " + daemon.address() + ": "));
  // The client uses a name that is not in the daemon's certificate.
  EXPECT_THAT(OneLine(Run({"models", "--server", daemon.address(), "--tls-ca", ca_,
                           "--tls-server-name", "rig.example.org", "--token-file", reader_file_}),
                      3),
              StartsWith("polyest: server " + daemon.address() + ": "));
}

TEST_F(SecurityTest, SaysInEveryKindOfCallThatTheDaemonMayServeTlsOnly) {
  DaemonProcess daemon(WithTls());
  // One record: its length, its checksum, and the end.
  const std::string session =
      File("rig.session", "polyest session 2\n" + std::string("\x02\0\0\0"
                                                              "\xdf\x54\x6b\xe6"
                                                              "\x22\0",
                                                              10));
  for (const std::vector<std::string>& command : {std::vector<std::string>{"models"},
                                                  {"watch", "rig"},
                                                  {"export", "rig", folder_ / "exported"},
                                                  {"import", session}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"--server", daemon.address()});
    EXPECT_THAT(OneLine(Run(arguments), 3),
                HasSubstr("if it serves TLS only, give its CA with --tls-ca"))
        << command[0];
  }
}

TEST_F(SecurityTest, NamesFilesThatAreNoGoodAndNothingOfThem) {
  const std::string bad = File("bad", "secret words");
  const auto models = [](const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"models", "--server", "localhost:1"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return OneLine(Run(arguments), 2);
  };
  EXPECT_THAT(models({"--tls-ca", bad}),
              AllOf(HasSubstr("--tls-ca: " + bad + " has no certificate in PEM form"),
                    Not(HasSubstr("secret"))));
  EXPECT_THAT(models({"--tls-ca", "/nowhere/ca.pem"}),
              HasSubstr("/nowhere/ca.pem: cannot be read"));
  EXPECT_THAT(models({"--token-file", bad}),
              AllOf(HasSubstr("token: must be one word"), Not(HasSubstr("secret"))));
  EXPECT_THAT(models({"--token-file", File("empty", "\n")}), HasSubstr("is empty"));
  EXPECT_THAT(models({"--tls-certificate", certificate_}), HasSubstr("--tls-key"));
}

TEST_F(SecurityTest, SaysBeforeItConnectsWhichCertificateOrKeyIsNoGood) {
  const auto models = [this](const std::string& certificate, const std::string& key) {
    return OneLine(Run({"models", "--server", "localhost:1", "--tls-ca", ca_, "--tls-certificate",
                        certificate, "--tls-key", key}),
                   2);
  };
  EXPECT_THAT(models(key_, key_),
              HasSubstr("--tls-certificate: " + key_ + " has no certificate in PEM form"));
  EXPECT_THAT(models(certificate_, certificate_),
              HasSubstr("--tls-key: " + certificate_ + " has no private key in PEM form"));
  EXPECT_THAT(models(certificate_, File("other.key", authority_.Issue("other").key)),
              HasSubstr("other.key is not the key of " + certificate_));
  const std::string half =
      authority_.certificate() + "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n";
  EXPECT_THAT(
      OneLine(Run({"models", "--server", "localhost:1", "--tls-ca", File("half", half)}), 2),
      HasSubstr("half has 1 certificate and then one that cannot be read: "));
}

TEST_F(SecurityTest, ShowsAClientsCertificateToADaemonThatAsksForOne) {
  DaemonProcess daemon(
      {"--tls-certificate", certificate_, "--tls-key", key_, "--tls-client-ca", ca_});
  const IssuedCertificate rig = authority_.Issue("rig");
  EXPECT_EQ(Run({"models", "--server", daemon.address(), "--tls-ca", ca_, "--tls-certificate",
                 File("rig.pem", rig.certificate), "--tls-key", File("rig.key", rig.key)})
                .exit_status,
            0);
  OneLine(Run({"models", "--server", daemon.address(), "--tls-ca", ca_}), 3);
}

}  // namespace
}  // namespace polyest::internal
