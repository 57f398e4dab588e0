#pragma once

// Reads the file of tokens: one a line, as NAME TENANT ROLE SHA256, with spaces or tabs between. A
// '#' starts a comment; empty lines are ignored. Several tokens may have the same name, so that an
// old one stays valid until its successor is everywhere.

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstddef>
#include <cstring>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/security/caller.h"
#include "server/security/token.h"

namespace polyest::internal {

class TokenTable {
 public:
  static constexpr size_t kMaxTokens = 10'000;

  // Reads the tokens from a file, or from its text. INVALID_ARGUMENT names file, line and rule, and
  // quotes nothing, because what stands in a wrong place may be a secret. A file without a token is
  // INVALID_ARGUMENT, too. NOT_FOUND when the file cannot be read.
  static absl::StatusOr<TokenTable> Read(const std::string& file);
  static absl::StatusOr<TokenTable> Parse(absl::string_view text, const std::string& file);

  // Returns the caller who has the token; nothing when the token is not in the file. It is looked
  // up by its digest, in a time that does not grow with their number. What the time tells is about
  // a digest, from which no token can be found.
  std::optional<Caller> Find(absl::string_view token) const;
  size_t size() const { return callers_.size(); }

 private:
  struct Token {
    TokenDigest digest;
    Caller caller;
  };

  // A digest is as good as random, so that its first bytes are a hash.
  struct FirstBytes {
    size_t operator()(const TokenDigest& digest) const {
      size_t first = 0;
      std::memcpy(&first, digest.data(), sizeof first);
      return first;
    }
  };

  static absl::StatusOr<Token> ParseLine(absl::string_view line);

  std::unordered_map<TokenDigest, Caller, FirstBytes> callers_;
};

// Holds a new token and its line for the file, without an end of line.
struct NewToken {
  std::string secret;
  std::string line;
};
// Makes a token for `words`, which are NAME:TENANT:ROLE; INVALID_ARGUMENT for anything else.
absl::StatusOr<NewToken> MakeTokenFor(absl::string_view words);

}  // namespace polyest::internal
