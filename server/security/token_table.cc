#include "server/security/token_table.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <utility>
#include <vector>

#include "core/common/status.h"
#include "proto/wire/transport/file_text.h"

namespace polyest::internal {
namespace {

constexpr char kWordRule[] =
    "must be 1 to 64 letters, digits, '.', '-' and '_', the first a letter or a digit";
constexpr char kRoleRule[] = "the role must be reader, writer, admin or operator";

absl::StatusOr<Caller> ParseCaller(absl::string_view name, absl::string_view tenant,
                                   absl::string_view role_name) {
  if (!IsCallerWord(name)) {
    return absl::InvalidArgumentError(absl::StrCat("the name ", kWordRule));
  }
  if (!IsCallerWord(tenant)) {
    return absl::InvalidArgumentError(absl::StrCat("the tenant ", kWordRule));
  }
  const std::optional<Role> role = ParseRole(role_name);
  if (!role) return absl::InvalidArgumentError(kRoleRule);
  return Caller{std::string(tenant), *role, std::string(name)};
}

}  // namespace

absl::StatusOr<TokenTable::Token> TokenTable::ParseLine(absl::string_view line) {
  const std::vector<absl::string_view> words =
      absl::StrSplit(line, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
  if (words.size() != 4) {
    return absl::InvalidArgumentError("a token is NAME TENANT ROLE SHA256, four words");
  }
  Token token;
  POLYEST_ASSIGN_OR_RETURN(token.caller, ParseCaller(words[0], words[1], words[2]));
  const std::optional<TokenDigest> digest = DigestFromHex(words[3]);
  if (!digest) {
    return absl::InvalidArgumentError("the SHA-256 of the token must be 64 hexadecimal digits");
  }
  token.digest = *digest;
  return token;
}

absl::StatusOr<TokenTable> TokenTable::Parse(absl::string_view text, const std::string& file) {
  TokenTable table;
  int line_number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    ++line_number;
    const auto refuse = [&](absl::string_view rule) {
      return absl::InvalidArgumentError(
          absl::StrFormat("%s, line %d: %s", file, line_number, rule));
    };
    line = line.substr(0, line.find('#'));
    if (line.find_first_not_of(" \t\r") == absl::string_view::npos) continue;
    absl::StatusOr<Token> token = ParseLine(line);
    if (!token.ok()) return refuse(token.status().message());
    if (!table.callers_.emplace(token->digest, std::move(token->caller)).second) {
      return refuse("the same token stands on a line before");
    }
    if (table.callers_.size() > kMaxTokens) {
      return refuse(absl::StrCat("there may be ", kMaxTokens, " tokens"));
    }
  }
  if (table.callers_.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        file, ": there is no token in it, so that nobody could get in; polyestd --new-token makes ",
        "one"));
  }
  return table;
}

absl::StatusOr<TokenTable> TokenTable::Read(const std::string& file) {
  POLYEST_ASSIGN_OR_RETURN(const std::string text, ReadFileText(file));
  return Parse(text, file);
}

std::optional<Caller> TokenTable::Find(absl::string_view token) const {
  const auto found = callers_.find(DigestOf(token));
  if (found == callers_.end()) return std::nullopt;
  return found->second;
}

absl::StatusOr<NewToken> MakeTokenFor(absl::string_view words) {
  const std::vector<absl::string_view> parts = absl::StrSplit(words, ':');
  if (parts.size() != 3) {
    return absl::InvalidArgumentError(
        absl::StrFormat("\"%s\" must be NAME:TENANT:ROLE, as in rig1:chassis:writer", words));
  }
  POLYEST_ASSIGN_OR_RETURN(const Caller caller, ParseCaller(parts[0], parts[1], parts[2]));
  NewToken token;
  token.secret = MakeToken();
  token.line = absl::StrJoin(
      {caller.name, caller.tenant, RoleName(caller.role), ToHex(DigestOf(token.secret))}, " ");
  return token;
}

}  // namespace polyest::internal
