#pragma once

// Issues certificates while a test runs.

#include <openssl/types.h>

#include <memory>
#include <string>

namespace polyest::internal {

// A certificate and its key as PEM texts.
struct IssuedCertificate {
  std::string certificate;
  std::string key;
};

class CertificateAuthority {
 public:
  explicit CertificateAuthority(const std::string& name);

  // Returns the authority's own certificate as PEM text.
  const std::string& certificate() const { return certificate_pem_; }

  enum class Validity { kNow, kExpired };
  // Issues a certificate that is valid for a server on localhost and 127.0.0.1 and for clients.
  IssuedCertificate Issue(const std::string& common_name, Validity validity = Validity::kNow) const;

 private:
  std::shared_ptr<EVP_PKEY> key_;
  std::shared_ptr<X509> certificate_;
  std::string certificate_pem_;
};

}  // namespace polyest::internal
