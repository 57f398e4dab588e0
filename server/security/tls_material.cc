#include "server/security/tls_material.h"

#include <absl/strings/str_cat.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <memory>

#include "core/common/status.h"
#include "proto/wire/transport/file_text.h"

namespace polyest::internal {
namespace {

template <auto Free>
struct Freer {
  template <typename Object>
  void operator()(Object* object) const {
    Free(object);
  }
};
using Bio = std::unique_ptr<BIO, Freer<&BIO_free_all>>;
using Certificate = std::unique_ptr<X509, Freer<&X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freer<&EVP_PKEY_free>>;
using Context = std::unique_ptr<SSL_CTX, Freer<&SSL_CTX_free>>;

// Gives OpenSSL no passphrase, for which it would otherwise ask the terminal.
int NoPassphrase(char*, int, int, void*) { return -1; }

Bio Reader(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// Returns OpenSSL's reason for the last failure, and clears it.
std::string Reason() {
  const char* const reason = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  return reason == nullptr ? "unknown reason" : reason;
}

absl::StatusOr<Certificate> FirstCertificate(const std::string& text) {
  const Bio in = Reader(text);
  Certificate certificate(PEM_read_bio_X509(in.get(), nullptr, &NoPassphrase, nullptr));
  if (certificate == nullptr) {
    ERR_clear_error();
    return absl::InvalidArgumentError("has no certificate in PEM form");
  }
  return certificate;
}

absl::StatusOr<Key> PrivateKey(const std::string& text) {
  const Bio in = Reader(text);
  Key key(PEM_read_bio_PrivateKey(in.get(), nullptr, &NoPassphrase, nullptr));
  if (key == nullptr) {
    ERR_clear_error();
    return absl::InvalidArgumentError("has no private key in PEM form without a passphrase");
  }
  return key;
}

absl::StatusOr<std::string> ReadFor(const std::string& option, const std::string& file) {
  auto text = ReadFileText(file);
  if (text.ok()) return text;
  return absl::NotFoundError(absl::StrCat(option, ": ", text.status().message()));
}

absl::Status Refuse(const std::string& option, const std::string& file, absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat(option, ": ", file, " ", why));
}

// Checks the certificate and the key as gRPC will use them, which also finds keys that are too
// short for OpenSSL.
absl::Status CheckPair(X509* certificate, EVP_PKEY* key, const TlsFiles& files) {
  const Context context(SSL_CTX_new(TLS_server_method()));
  if (SSL_CTX_use_certificate(context.get(), certificate) != 1) {
    return Refuse("--tls-certificate", files.certificate,
                  absl::StrCat("has a certificate that cannot be used: ", Reason()));
  }
  if (SSL_CTX_use_PrivateKey(context.get(), key) != 1 ||
      SSL_CTX_check_private_key(context.get()) != 1) {
    return Refuse("--tls-key", files.key,
                  absl::StrCat("is not the key of ", files.certificate, ": ", Reason()));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TlsMaterial> ReadTlsMaterial(const TlsFiles& files) {
  TlsMaterial material;
  POLYEST_ASSIGN_OR_RETURN(material.certificate, ReadFor("--tls-certificate", files.certificate));
  POLYEST_ASSIGN_OR_RETURN(material.key, ReadFor("--tls-key", files.key));
  const auto certificate = FirstCertificate(material.certificate);
  if (!certificate.ok()) {
    return Refuse("--tls-certificate", files.certificate, certificate.status().message());
  }
  const auto key = PrivateKey(material.key);
  if (!key.ok()) return Refuse("--tls-key", files.key, key.status().message());
  if (X509_cmp_current_time(X509_get0_notAfter(certificate->get())) <= 0) {
    return Refuse("--tls-certificate", files.certificate, "has expired");
  }
  POLYEST_RETURN_IF_ERROR(CheckPair(certificate->get(), key->get(), files));
  if (files.client_ca.empty()) return material;
  POLYEST_ASSIGN_OR_RETURN(material.client_ca, ReadFor("--tls-client-ca", files.client_ca));
  const auto authority = FirstCertificate(material.client_ca);
  if (!authority.ok()) {
    return Refuse("--tls-client-ca", files.client_ca, authority.status().message());
  }
  return material;
}

}  // namespace polyest::internal
