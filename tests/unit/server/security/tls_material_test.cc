#include "server/security/tls_material.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/security/server_tls.h"
#include "tests/testing/certificates.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::StartsWith;

class TlsMaterialTest : public testing::Test {
 protected:
  TlsMaterialTest() : authority_("test CA") {
    const IssuedCertificate daemon = authority_.Issue("daemon");
    files_ = {folder_.Write("daemon.pem", daemon.certificate),
              folder_.Write("daemon.key", daemon.key),
              folder_.Write("ca.pem", authority_.certificate())};
  }

  std::string Refusal() const {
    const auto material = ReadTlsMaterial(files_);
    EXPECT_FALSE(material.ok());
    return std::string(material.status().message());
  }

  const CertificateAuthority authority_;
  TestFolder folder_;
  TlsFiles files_;
};

TEST_F(TlsMaterialTest, ReadsWhatBelongsTogether) {
  const auto material = ReadTlsMaterial(files_);
  ASSERT_TRUE(material.ok()) << material.status();
  EXPECT_EQ(material->client_ca, authority_.certificate());
}

TEST_F(TlsMaterialTest, NamesOptionAndFileThatCannotBeRead) {
  files_.key = "/nowhere/key";
  EXPECT_EQ(Refusal(), "--tls-key: /nowhere/key: cannot be read: No such file or directory");
}

TEST_F(TlsMaterialTest, RefusesTheKeyOfAnotherCertificate) {
  folder_.Write("daemon.key", authority_.Issue("daemon").key);
  EXPECT_THAT(Refusal(), StartsWith("--tls-key: " + files_.key + " is not the key of " +
                                    files_.certificate + ": "));
}

TEST_F(TlsMaterialTest, RefusesWhatIsNoPem) {
  folder_.Write("daemon.key", "nonsense");
  EXPECT_EQ(Refusal(),
            "--tls-key: " + files_.key + " has no private key in PEM form without a passphrase");
  folder_.Write("daemon.pem", "");
  EXPECT_EQ(Refusal(),
            "--tls-certificate: " + files_.certificate + " has no certificate in PEM form");
}

TEST_F(TlsMaterialTest, RefusesAnExpiredCertificate) {
  const auto expired = authority_.Issue("daemon", CertificateAuthority::Validity::kExpired);
  folder_.Write("daemon.pem", expired.certificate);
  folder_.Write("daemon.key", expired.key);
  EXPECT_EQ(Refusal(), "--tls-certificate: " + files_.certificate + " has expired");
}

TEST_F(TlsMaterialTest, RefusesAClientCaThatIsNone) {
  folder_.Write("ca.pem", "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n");
  EXPECT_EQ(Refusal(), "--tls-client-ca: " + files_.client_ca + " has no certificate in PEM form");
}

TEST_F(TlsMaterialTest, KeepsServingWhenNewFilesAreNoGood) {
  const auto tls = ServerTls::Open(files_);
  ASSERT_TRUE(tls.ok()) << tls.status();
  folder_.Write("daemon.key", "nonsense");
  EXPECT_EQ((*tls)->Reload().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE((*tls)->Credentials(), nullptr);
}

}  // namespace
}  // namespace polyest::internal
