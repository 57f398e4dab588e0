#include "tests/testing/certificates.h"

#include <openssl/ec.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr long kDay_s = 24 * 60 * 60;

std::shared_ptr<EVP_PKEY> NewKey() { return {EVP_EC_gen("P-256"), &EVP_PKEY_free}; }

std::string Text(const std::shared_ptr<BIO>& memory) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(memory.get(), &data);
  return std::string(data, static_cast<size_t>(size));
}

std::string ToPem(X509* certificate) {
  const std::shared_ptr<BIO> memory(BIO_new(BIO_s_mem()), &BIO_free_all);
  POLYEST_CHECK(PEM_write_bio_X509(memory.get(), certificate) == 1);
  return Text(memory);
}

std::string ToPem(EVP_PKEY* key) {
  const std::shared_ptr<BIO> memory(BIO_new(BIO_s_mem()), &BIO_free_all);
  POLYEST_CHECK(
      PEM_write_bio_PrivateKey(memory.get(), key, nullptr, nullptr, 0, nullptr, nullptr) == 1);
  return Text(memory);
}

void Extend(X509* certificate, int kind, const char* value) {
  X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, nullptr, kind, value);
  POLYEST_CHECK(extension != nullptr && X509_add_ext(certificate, extension, -1) == 1);
  X509_EXTENSION_free(extension);
}

// Returns an unsigned certificate that is valid for `days` days from two days ago.
std::shared_ptr<X509> NewCertificate(const std::string& common_name, EVP_PKEY* key, long days) {
  std::shared_ptr<X509> certificate(X509_new(), &X509_free);
  uint64_t serial = 0;
  POLYEST_CHECK(RAND_bytes(reinterpret_cast<unsigned char*>(&serial), 7) == 1);
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(certificate.get()), serial);
  X509_set_version(certificate.get(), X509_VERSION_3);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -2 * kDay_s);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), (days - 2) * kDay_s);
  X509_NAME_add_entry_by_txt(X509_get_subject_name(certificate.get()), "CN", MBSTRING_UTF8,
                             reinterpret_cast<const unsigned char*>(common_name.c_str()), -1, -1,
                             0);
  POLYEST_CHECK(X509_set_pubkey(certificate.get(), key) == 1);
  return certificate;
}

void Sign(X509* certificate, X509* authority, EVP_PKEY* key) {
  X509_set_issuer_name(certificate, X509_get_subject_name(authority));
  POLYEST_CHECK(X509_sign(certificate, key, EVP_sha256()) > 0);
}

}  // namespace

CertificateAuthority::CertificateAuthority(const std::string& name)
    : key_(NewKey()), certificate_(NewCertificate(name, key_.get(), 30)) {
  Extend(certificate_.get(), NID_basic_constraints, "critical,CA:TRUE");
  Sign(certificate_.get(), certificate_.get(), key_.get());
  certificate_pem_ = ToPem(certificate_.get());
}

IssuedCertificate CertificateAuthority::Issue(const std::string& common_name,
                                              Validity validity) const {
  const auto key = NewKey();
  const auto certificate =
      NewCertificate(common_name, key.get(), validity == Validity::kExpired ? 1 : 30);
  Extend(certificate.get(), NID_subject_alt_name, "DNS:localhost,IP:127.0.0.1");
  Sign(certificate.get(), certificate_.get(), key_.get());
  return {ToPem(certificate.get()), ToPem(key.get())};
}

}  // namespace polyest::internal
