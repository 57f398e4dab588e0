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

TEST(CleanText, DropsWhatIsNotUtf8) {
  EXPECT_EQ(CleanText("a\xff"
                      "b\x80"
                      "c"),
            "abc");
  EXPECT_EQ(CleanText("aé", 2), "a");                                         // cut in two
  EXPECT_EQ(CleanText("a\xed\xa0\xbd\xed\xb8\x80z"), "az");                   // a pair of UTF-16
  EXPECT_EQ(CleanText("a\xf4\x90\x80\x80z"), "az");                           // beyond U+10FFFF
  EXPECT_EQ(CleanText("a\xc1\x81z\xe0\x81\x81z\xf0\x80\x81\x81"), "aAzAzA");  // longer than needed
}

}  // namespace
}  // namespace polyest::internal
