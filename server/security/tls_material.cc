#include "server/security/tls_material.h"

#include <utility>

#include "core/common/status.h"
#include "proto/wire/transport/pem_file.h"

namespace polyest::internal {

absl::StatusOr<TlsMaterial> ReadTlsMaterial(const TlsFiles& files) {
  POLYEST_ASSIGN_OR_RETURN(PemFile certificate,
                           ReadPemFile("--tls-certificate", files.certificate));
  POLYEST_ASSIGN_OR_RETURN(PemFile key, ReadPemFile("--tls-key", files.key));
  POLYEST_RETURN_IF_ERROR(CheckCertificateAndKey(certificate, key));
  TlsMaterial material{std::move(certificate.text), std::move(key.text), {}};
  if (files.client_ca.empty()) return material;
  POLYEST_ASSIGN_OR_RETURN(PemFile authorities, ReadPemFile("--tls-client-ca", files.client_ca));
  POLYEST_RETURN_IF_ERROR(CheckCertificates(authorities));
  material.client_ca = std::move(authorities.text);
  return material;
}

}  // namespace polyest::internal
