#include "server/digest/sha256.h"

#include <openssl/evp.h>

#include "core/common/check.h"

namespace polyest {

Sha256Digest Sha256(std::string_view bytes) {
  Sha256Digest digest;
  unsigned int length = 0;
  POLYEST_CHECK(
      EVP_Digest(bytes.data(), bytes.size(), digest.data(), &length, EVP_sha256(), nullptr) == 1 &&
      length == digest.size());
  return digest;
}

}  // namespace polyest
