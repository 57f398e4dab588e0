#include "core/common/utf8.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(CharacterLength, IsThatOfTheFirstCharacter) {
  EXPECT_EQ(CharacterLength("ab"), 1);
  EXPECT_EQ(CharacterLength("éb"), 2);
  EXPECT_EQ(CharacterLength("€b"), 3);
  EXPECT_EQ(CharacterLength("🚗b"), 4);
  EXPECT_EQ(CharacterLength(absl::string_view("\0b", 2)), 1);
}

TEST(IsUtf8, TakesTheCharactersBesideWhatItRefuses) {
  EXPECT_TRUE(IsUtf8(""));
  EXPECT_TRUE(IsUtf8("\xC2\x80 \xE0\xA0\x80 \xED\x9F\xBF \xEE\x80\x80"));
  EXPECT_TRUE(IsUtf8("\xF0\x90\x80\x80 \xF4\x8F\xBF\xBF"));
}

TEST(IsUtf8, RefusesWhatIsNoCharacter) {
  EXPECT_FALSE(IsUtf8("a\x80"));             // continues nothing
  EXPECT_FALSE(IsUtf8("a\xC3"));             // cut off
  EXPECT_FALSE(IsUtf8("\xE2\x82z"));         // cut off by the next
  EXPECT_FALSE(IsUtf8("\xC1\x81"));          // longer than needed
  EXPECT_FALSE(IsUtf8("\xE0\x9F\xBF"));      // longer than needed
  EXPECT_FALSE(IsUtf8("\xF0\x8F\xBF\xBF"));  // longer than needed
  EXPECT_FALSE(IsUtf8("\xED\xA0\x80"));      // a surrogate, U+D800
  EXPECT_FALSE(IsUtf8("\xED\xBF\xBF"));      // a surrogate, U+DFFF
  EXPECT_FALSE(IsUtf8("\xF4\x90\x80\x80"));  // beyond U+10FFFF
  EXPECT_FALSE(IsUtf8("\xFF"));
}

TEST(ValidUtf8, ReplacesEachByteThatBelongsToNoCharacter) {
  EXPECT_EQ(ValidUtf8("é 🚗"), "é 🚗");
  EXPECT_EQ(ValidUtf8("a\xFFz\xC3"), "a?z?");
  EXPECT_EQ(ValidUtf8("\xED\xA0\x80z"), "???z");
  EXPECT_EQ(ValidUtf8("\xC3é"), "?é");
}

TEST(CutAt, CutsBetweenCharacters) {
  EXPECT_EQ(CutAt("aé", 3), "aé");
  EXPECT_EQ(CutAt("aé", 2), "a");
  EXPECT_EQ(CutAt("a🚗z", 4), "a");
  EXPECT_EQ(CutAt("a🚗z", 5), "a🚗");
  EXPECT_EQ(CutAt("é", 1), "");
  EXPECT_EQ(CutAt("abc", 0), "");
}

TEST(CutAt, CutsWhatIsNotUtf8AnywhereButNotFarBefore) {
  EXPECT_EQ(CutAt(std::string(9, '\x80'), 6), std::string(6, '\x80'));
  EXPECT_EQ(CutAt(std::string(9, '\x80'), 1), "\x80");
}

}  // namespace
}  // namespace polyest::internal
