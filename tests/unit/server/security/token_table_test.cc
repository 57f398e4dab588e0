#include "server/security/token_table.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kDigest(64, 'a');

std::string Refusal(const std::string& text) {
  const auto table = TokenTable::Parse(text, "tokens");
  EXPECT_EQ(table.status().code(), absl::StatusCode::kInvalidArgument) << text;
  return std::string(table.status().message());
}

TEST(TokenTable, FindsWhoHasTheToken) {
  const NewToken rig = *MakeTokenFor("rig1:chassis:writer");
  const NewToken boss = *MakeTokenFor("anna:engines:admin");
  const auto table = TokenTable::Parse(
      "# tokens\n\n" + rig.line + "  # the left rig\n\t" + boss.line + "\r\n", "tokens");
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_EQ(table->size(), 2);
  const auto found = table->Find(rig.secret);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->name, "rig1");
  EXPECT_EQ(found->tenant, "chassis");
  EXPECT_EQ(found->role, Role::kWriter);
  EXPECT_EQ(table->Find(boss.secret)->tenant, "engines");
}

TEST(TokenTable, FindsNobodyForOtherTokens) {
  const NewToken rig = *MakeTokenFor("rig1:chassis:writer");
  const auto table = TokenTable::Parse(rig.line, "tokens");
  EXPECT_FALSE(table->Find(""));
  EXPECT_FALSE(table->Find(rig.secret + " "));
  EXPECT_FALSE(table->Find(rig.secret.substr(0, rig.secret.size() - 1)));
  EXPECT_FALSE(table->Find(MakeToken()));
  // The digest, which the file shows, is not a token.
  EXPECT_FALSE(table->Find(ToHex(DigestOf(rig.secret))));
}

TEST(TokenTable, FindsEveryTokenOfALargeFileAndTakesNoneMore) {
  const auto line = [](size_t k) {
    return absl::StrCat("rig", k, " chassis writer ", ToHex(DigestOf(absl::StrCat(k))), "\n");
  };
  std::string text;
  for (size_t k = 0; k < TokenTable::kMaxTokens; ++k) text += line(k);
  const auto table = TokenTable::Parse(text, "tokens");
  ASSERT_TRUE(table.ok()) << table.status();
  for (size_t k = 0; k < TokenTable::kMaxTokens; ++k) {
    const auto found = table->Find(absl::StrCat(k));
    ASSERT_TRUE(found) << k;
    ASSERT_EQ(found->name, absl::StrCat("rig", k));
  }
  EXPECT_FALSE(table->Find(absl::StrCat(TokenTable::kMaxTokens)));
  EXPECT_EQ(Refusal(text + line(TokenTable::kMaxTokens)),
            "tokens, line 10001: there may be 10000 tokens");
}

TEST(TokenTable, RefusesAFileWithoutAToken) {
  for (const char* empty : {"", "\n \n", "# nobody"}) {
    const absl::Status refused = TokenTable::Parse(empty, "tokens").status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(refused.message()),
                testing::StartsWith("tokens: there is no token in it"));
  }
}

TEST(TokenTable, TakesTwoTokensOfOneName) {
  const std::string line = MakeTokenFor("rig1:chassis:writer")->line;
  const std::string next = MakeTokenFor("rig1:chassis:writer")->line;
  EXPECT_EQ(TokenTable::Parse(line + "\n" + next, "tokens")->size(), 2);
}

TEST(TokenTable, NamesFileLineAndRuleOfAMalformedLine) {
  EXPECT_EQ(Refusal("\nrig1 chassis writer"),
            "tokens, line 2: a token is NAME TENANT ROLE SHA256, four words");
  EXPECT_THAT(Refusal("rig1 chassis writer " + kDigest + " more"), HasSubstr("four words"));
  EXPECT_THAT(Refusal("-rig chassis writer " + kDigest), StartsWith("tokens, line 1: the name"));
  EXPECT_THAT(Refusal("rig1 " + std::string(65, 'x') + " writer " + kDigest),
              StartsWith("tokens, line 1: the tenant"));
  EXPECT_EQ(Refusal("rig1 chassis Writer " + kDigest),
            "tokens, line 1: the role must be reader, writer, admin or operator");
  for (const std::string& digest : {kDigest + "a", kDigest.substr(1), std::string(64, 'g')}) {
    EXPECT_EQ(Refusal("rig1 chassis writer " + digest),
              "tokens, line 1: the SHA-256 of the token must be 64 hexadecimal digits");
  }
  EXPECT_EQ(Refusal("a b writer " + kDigest + "\nc d reader " + std::string(64, 'A')),
            "tokens, line 2: the same token stands on a line before");
}

TEST(TokenTable, QuotesNoSecretOfAMalformedLine) {
  const std::string secret = MakeToken();
  for (const std::string& line :
       {"rig1 chassis writer " + secret, secret + " chassis writer " + kDigest,
        "rig1 chassis " + secret + " " + kDigest, secret}) {
    EXPECT_THAT(Refusal(line), Not(HasSubstr(secret.substr(8, 8)))) << line;
  }
}

TEST(TokenTable, SaysWhichFileCannotBeRead) {
  const auto table = TokenTable::Read("/nowhere/tokens");
  EXPECT_EQ(table.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(table.status().message(), "/nowhere/tokens: cannot be read: No such file or directory");
}

TEST(Token, HasTheDigestOfTheStandard) {
  // The digest is that of FIPS 180-2, appendix B.1.
  EXPECT_EQ(ToHex(DigestOf("abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Token, IsAnotherOneEachTime) {
  std::set<std::string> tokens;
  for (int k = 0; k < 100; ++k) tokens.insert(MakeToken());
  EXPECT_EQ(tokens.size(), 100);
  EXPECT_THAT(*tokens.begin(), testing::MatchesRegex("polyest_[0-9a-f]*"));
  EXPECT_EQ(tokens.begin()->size(), 8 + 64);
}

TEST(Token, IsMadeForANameATenantAndARoleOnly) {
  for (const char* words : {"", "rig1", "rig1:chassis", "rig1:chassis:owner", "rig1::reader",
                            "a b:c:reader", "a:b:reader:c"}) {
    EXPECT_EQ(MakeTokenFor(words).status().code(), absl::StatusCode::kInvalidArgument) << words;
  }
}

}  // namespace
}  // namespace polyest::internal
