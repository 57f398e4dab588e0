#pragma once

// Makes and recognizes bearer tokens. A token has 256 random bits, of which the daemon keeps the
// SHA-256 only.
//
// A password needs a slow, salted hash because it can be guessed. A token of 256 random bits
// cannot, whatever the speed of the hash, and no two tokens are the same: a plain SHA-256 is
// enough, and quick enough to compute for every call.

#include <absl/strings/string_view.h>

#include <optional>
#include <string>

#include "server/digest/digest.h"

namespace polyest::internal {

using TokenDigest = Sha256Digest;

// Returns a new token: "polyest_" and 64 hexadecimal digits, which scanners for secrets recognize.
std::string MakeToken();

TokenDigest DigestOf(absl::string_view token);
std::string ToHex(const TokenDigest& digest);
// Returns the digest in `hex`; nothing unless `hex` is 64 hexadecimal digits.
std::optional<TokenDigest> DigestFromHex(absl::string_view hex);
// Compares digests, in the same time whatever they are.
bool SameDigest(const TokenDigest& a, const TokenDigest& b);

}  // namespace polyest::internal
