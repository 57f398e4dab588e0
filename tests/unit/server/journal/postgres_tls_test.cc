// Tests connections to the database by TLS, with a password or a certificate from files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <sstream>

#include "server/journal/postgres_journal.h"
#include "tests/testing/certificates.h"
#include "tests/testing/postgres_server.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/test_folder.h"
#include "tests/unit/server/journal/append_batch.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kPassword[] = "hunter2";

class PostgresTlsTest : public testing::Test {
 protected:
  // Returns the URI of a role, with more parameters.
  std::string Uri(const std::string& role, const std::string& more) const {
    return "postgresql:///test1?host=localhost&hostaddr=" + address_ + "&user=" + role + more;
  }
  std::string Verified() const { return "&sslmode=verify-full&sslrootcert=" + ca_; }
  // Writes a file that only its owner may read, as libpq demands.
  std::string WriteSecret(const std::string& text) {
    const std::string path = folder_.Write("secret-" + std::to_string(++files_), text);
    EXPECT_EQ(chmod(path.c_str(), S_IRUSR), 0);
    return path;
  }
  std::string Password(const std::string& password) {
    return "&passfile=" + WriteSecret("*:*:*:*:" + password + "\n");
  }
  void ExpectUsed(const std::string& uri) {
    const auto journal = PostgresJournal::Open({.uri = uri});
    ASSERT_TRUE(journal.ok()) << journal.status();
    const int64_t session = CreateIn(**journal, "sessions/a", SmallProblem());
    v1::Measurements batch;
    batch.add_time_s(1);
    EXPECT_TRUE(AppendTo(**journal, session, 1, batch).ok());
    EXPECT_GT(server_.Number(local_,
                             "SELECT count(*) FROM pg_stat_ssl JOIN pg_stat_activity USING (pid) "
                             "WHERE ssl AND usename <> 'polyest'"),
              1);
  }
  // Expects that no journal is opened, that the log says why, and that nothing repeats a password.
  void ExpectRefused(const std::string& uri, const std::string& words) {
    std::ostringstream log;
    const auto before = spdlog::default_logger();
    spdlog::set_default_logger(std::make_shared<spdlog::logger>(
        "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
    const absl::Status refused = PostgresJournal::Open({.uri = uri}).status();
    spdlog::set_default_logger(before);
    EXPECT_EQ(refused.code(), absl::StatusCode::kUnavailable);
    EXPECT_THAT(log.str(), HasSubstr(words));
    EXPECT_THAT(log.str() + std::string(refused.message()), Not(HasSubstr("hunter")));
  }

  int files_ = 0;
  const TestFolder folder_;
  const CertificateAuthority authority_{"database CA"}, other_{"other CA"};
  const IssuedCertificate own_ = authority_.Issue("db");
  const std::string ca_ = folder_.Write("ca.pem", authority_.certificate());
  PostgresServer server_;
  const std::string local_ = server_.MakeDatabase();
  const std::string address_ =
      server_.ServeTls(own_.certificate, own_.key, authority_.certificate(), kPassword);
};

TEST_F(PostgresTlsTest, TakesAPasswordFromAFile) {
  ExpectUsed(Uri("rig", Verified() + Password(kPassword)));
  ExpectRefused(Uri("rig", Verified() + Password("hunter3")), "password authentication failed");
  ExpectRefused(Uri("rig", "&sslmode=disable" + Password(kPassword)), "no encryption");
}

TEST_F(PostgresTlsTest, TakesACertificateFromFiles) {
  const auto certified = [&](const IssuedCertificate& certificate) {
    return Verified() + "&sslcert=" + folder_.Write("client.pem", certificate.certificate) +
           "&sslkey=" + WriteSecret(certificate.key);
  };
  ExpectUsed(Uri("lab", certified(authority_.Issue("lab"))));
  ExpectRefused(Uri("lab", certified(authority_.Issue("office"))), "certificate");
  ExpectRefused(Uri("lab", certified(other_.Issue("lab"))), "unknown ca");
  ExpectRefused(Uri("lab", Verified()), "certificate");
}

TEST_F(PostgresTlsTest, BelievesNoServerWithTheCertificateOfAnother) {
  const std::string ca = folder_.Write("other.pem", other_.certificate());
  ExpectRefused(Uri("rig", "&sslmode=verify-full&sslrootcert=" + ca + Password(kPassword)),
                "certificate verify failed");
  // The certificate is not one of that host.
  ExpectRefused("postgresql:///test1?host=db.example.org&hostaddr=" + address_ + "&user=rig" +
                    Verified() + Password("hunter4"),
                "does not match host name");
}

}  // namespace
}  // namespace polyest::internal
