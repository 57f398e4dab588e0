#include "core/external/clean_text.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(CleanText, IsOneLineWithoutWhiteSpaceAtItsEnd) {
  EXPECT_EQ(CleanText("one\ntwo\tthree \x7f\n"), "one two three");
}

TEST(CleanText, KeepsCharactersOfAnyLength) {
  EXPECT_EQ(CleanText("é ω 🚗"), "é ω 🚗");
  EXPECT_EQ(CleanText("\xed\x9f\xbf \xee\x80\x80 \xf4\x8f\xbf\xbf"),
            "\xed\x9f\xbf \xee\x80\x80 \xf4\x8f\xbf\xbf");  // U+D7FF, U+E000, U+10FFFF
}

TEST(CleanText, ReplacesWhatIsNotUtf8) {
  EXPECT_EQ(CleanText("a\xff"
                      "b\x80"
                      "c"),
            "a?b?c");
  EXPECT_EQ(CleanText("aé", 2), "a");  // cut between characters
  EXPECT_EQ(CleanText("a\xed\xa0\xbdz"), "a???z");
}

}  // namespace
}  // namespace polyest::internal
