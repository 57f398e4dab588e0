#pragma once

// Certificates made while a test runs.

#include <openssl/types.h>

#include <memory>
#include <string>

namespace polyest::internal {

// PEM texts.
struct IssuedCertificate {
  std::string certificate;
  std::string key;
};

class CertificateAuthority {
 public:
  explicit CertificateAuthority(const std::string& name);

  // PEM text.
  const std::string& certificate() const { return certificate_pem_; }

  enum class Validity { kNow, kExpired };
  // For localhost and 127.0.0.1 as a server, and for clients.
  IssuedCertificate Issue(const std::string& common_name, Validity validity = Validity::kNow) const;

 private:
  std::shared_ptr<EVP_PKEY> key_;
  std::shared_ptr<X509> certificate_;
  std::string certificate_pem_;
};

}  // namespace polyest::internal
