#include "proto/wire/transport/pem_file.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
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

absl::Status Refuse(const PemFile& file, absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat(file.option, ": ", file.file, " ", why));
}

Certificate NextCertificate(const Bio& in) {
  return Certificate(PEM_read_bio_X509(in.get(), nullptr, &NoPassphrase, nullptr));
}

absl::StatusOr<Certificate> FirstCertificate(const PemFile& file) {
  Certificate certificate = NextCertificate(Reader(file.text));
  if (certificate != nullptr) return certificate;
  ERR_clear_error();
  return Refuse(file, "has no certificate in PEM form");
}

absl::StatusOr<Key> PrivateKey(const PemFile& file) {
  Key key(PEM_read_bio_PrivateKey(Reader(file.text).get(), nullptr, &NoPassphrase, nullptr));
  if (key != nullptr) return key;
  ERR_clear_error();
  return Refuse(file, "has no private key in PEM form without a passphrase");
}

}  // namespace

absl::StatusOr<PemFile> ReadPemFile(const std::string& option, const std::string& file) {
  auto text = ReadFileText(file);
  if (text.ok()) return PemFile{option, file, *std::move(text)};
  return absl::NotFoundError(absl::StrCat(option, ": ", text.status().message()));
}

absl::Status CheckCertificates(const PemFile& file) {
  POLYEST_RETURN_IF_ERROR(FirstCertificate(file).status());
  const Bio in = Reader(file.text);
  int read = 0;
  while (NextCertificate(in) != nullptr) ++read;
  const bool at_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  const std::string reason = Reason();
  if (at_end) return absl::OkStatus();
  return Refuse(
      file, absl::StrCat("has ", read == 1 ? "1 certificate" : absl::StrCat(read, " certificates"),
                         " and then one that cannot be read: ", reason));
}

// Checks the certificate and the key as gRPC will use them, which also finds keys that are too
// short for OpenSSL.
absl::Status CheckCertificateAndKey(const PemFile& certificate, const PemFile& key) {
  POLYEST_ASSIGN_OR_RETURN(const Certificate first, FirstCertificate(certificate));
  POLYEST_ASSIGN_OR_RETURN(const Key secret, PrivateKey(key));
  if (X509_cmp_current_time(X509_get0_notAfter(first.get())) <= 0) {
    return Refuse(certificate, "has expired");
  }
  const Context context(SSL_CTX_new(TLS_method()));
  if (SSL_CTX_use_certificate(context.get(), first.get()) != 1) {
    return Refuse(certificate, absl::StrCat("has a certificate that cannot be used: ", Reason()));
  }
  if (SSL_CTX_use_PrivateKey(context.get(), secret.get()) != 1 ||
      SSL_CTX_check_private_key(context.get()) != 1) {
    return Refuse(key, absl::StrCat("is not the key of ", certificate.file, ": ", Reason()));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
