#pragma once

// The file of tokens: one a line, as NAME TENANT ROLE SHA256, with spaces or tabs between. A '#'
// starts a comment; empty lines count for nothing. Several tokens may have the same name, so that
// an old one stays good until its successor is everywhere.

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <optional>
#include <string>
#include <vector>

#include "server/security/caller.h"
#include "server/security/token.h"

namespace polyest::internal {

class TokenTable {
 public:
  static constexpr size_t kMaxTokens = 10'000;

  // INVALID_ARGUMENT names file, line and rule, and quotes nothing: what stands in a wrong place
  // may be a secret. A file without a token is INVALID_ARGUMENT, too. NOT_FOUND when the file
  // cannot be read.
  static absl::StatusOr<TokenTable> Read(const std::string& file);
  static absl::StatusOr<TokenTable> Parse(absl::string_view text, const std::string& file);

  // None for a token that is not in the file. Looks at all of them, in the same time whichever it
  // is.
  std::optional<Caller> Find(absl::string_view token) const;
  size_t size() const { return tokens_.size(); }

 private:
  struct Token {
    TokenDigest digest;
    Caller caller;
  };

  static absl::StatusOr<Token> ParseLine(absl::string_view line);

  std::vector<Token> tokens_;
};

// A new token and its line for the file, without an end of line. `words` is NAME:TENANT:ROLE;
// INVALID_ARGUMENT for anything else.
struct NewToken {
  std::string secret;
  std::string line;
};
absl::StatusOr<NewToken> MakeTokenFor(absl::string_view words);

}  // namespace polyest::internal
