#include "server/security/token.h"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <algorithm>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

absl::string_view Bytes(const TokenDigest& digest) {
  return absl::string_view(reinterpret_cast<const char*>(digest.data()), digest.size());
}

}  // namespace

std::string MakeToken() {
  TokenDigest secret;
  // Without random numbers there can be no token.
  POLYEST_CHECK(RAND_bytes(secret.data(), static_cast<int>(secret.size())) == 1);
  return absl::StrCat("polyest_", absl::BytesToHexString(Bytes(secret)));
}

TokenDigest DigestOf(absl::string_view token) { return Sha256({token.data(), token.size()}); }

std::string ToHex(const TokenDigest& digest) { return absl::BytesToHexString(Bytes(digest)); }

std::optional<TokenDigest> DigestFromHex(absl::string_view hex) {
  TokenDigest digest;
  if (hex.size() != 2 * digest.size() || !std::all_of(hex.begin(), hex.end(), [](unsigned char c) {
        return absl::ascii_isxdigit(c);
      })) {
    return std::nullopt;
  }
  const std::string bytes = absl::HexStringToBytes(hex);
  std::copy(bytes.begin(), bytes.end(), digest.begin());
  return digest;
}

bool SameDigest(const TokenDigest& a, const TokenDigest& b) {
  return CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace polyest::internal
