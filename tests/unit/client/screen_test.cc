#include "client/cli/screen.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>

#include "client/cli/text_table.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

std::string PrintOn(int columns, const TextTable& table) {
  std::ostringstream out;
  SetScreen(out, {.columns = columns, .rows = 0, .color = false});
  table.Print(out);
  return out.str();
}

TEST(Screen, GoesAlongWithTheFormatOfAStream) {
  std::ostringstream first;
  EXPECT_EQ(GetScreen(first).columns, 0);
  EXPECT_FALSE(GetScreen(first).color);
  SetScreen(first, {.columns = 72, .rows = 20, .color = true});
  std::ostringstream second;
  second.copyfmt(first);
  EXPECT_EQ(GetScreen(second).columns, 72);
  EXPECT_EQ(GetScreen(second).rows, 20);
  EXPECT_TRUE(GetScreen(second).color);
}

TEST(ScreenOf, HasNoLimitsWithoutATerminal) {
  const int file = open("/dev/null", O_WRONLY | O_CLOEXEC);
  ASSERT_GE(file, 0);
  EXPECT_EQ(ScreenOf(file, ColorChoice::kAuto).columns, 0);
  EXPECT_FALSE(ScreenOf(file, ColorChoice::kAuto).color);
  EXPECT_TRUE(ScreenOf(file, ColorChoice::kAlways).color);
  close(file);
}

TEST(Paint, LeavesTextAloneWithoutColours) {
  std::ostringstream out;
  EXPECT_EQ(Paint(out, Color::kRed, "bad"), "bad");
  SetScreen(out, {.columns = 0, .rows = 0, .color = true});
  EXPECT_EQ(Paint(out, Color::kRed, "bad"), "\x1b[31mbad\x1b[0m");
  EXPECT_EQ(Paint(out, Color::kRed, ""), "");
}

TEST(DisplayWidth, CountsWhatIsSeen) {
  EXPECT_EQ(DisplayWidth("1 ± 2"), 5);
  EXPECT_EQ(DisplayWidth("R̂"), 1);
  EXPECT_EQ(DisplayWidth("χ²/n"), 4);
  EXPECT_EQ(DisplayWidth("\x1b[31mbad\x1b[0m"), 3);
  EXPECT_EQ(DisplayWidth("\x1b[31"), 0);
}

TEST(WrapText, BreaksAtBlanks) {
  EXPECT_EQ(WrapText("one two three", 8), "one two\nthree");
  EXPECT_EQ(WrapText("one two three", 8, 2), "one two\n  three");
  EXPECT_EQ(WrapText("incomprehensibly long", 8), "incomprehensibly\nlong");
  EXPECT_EQ(WrapText("one two three", 0), "one two three");
  EXPECT_EQ(WrapText("one  two", 80), "one  two");
}

TEST(FittedTextTable, RepeatsTheFirstColumnWhereTheScreenEnds) {
  TextTable table({"t", "first", "second", "third"}, TextTable::Align::kRight);
  table.AddRow({"0", "1", "2", "3"});
  table.AddRow({"10", "11", "12", "13"});
  EXPECT_EQ(table.Width(), 24);
  EXPECT_EQ(PrintOn(24, table), PrintOn(0, table));
  EXPECT_EQ(PrintOn(18, table),
            " t  first  second\n"
            " 0      1       2\n"
            "10     11      12\n"
            "\n"
            " t  third\n"
            " 0      3\n"
            "10     13\n");
}

TEST(FittedTextTable, BreaksProseBeforeItIsSplit) {
  TextTable table({"model", "summary"});
  table.AddRow({"duffing", "A mass on a spring that gets stiffer the more it is stretched"});
  EXPECT_EQ(PrintOn(45, table),
            "model    summary\n"
            "duffing  A mass on a spring that gets stiffer\n"
            "         the more it is stretched\n");
}

TEST(FittedTextTable, KeepsAColumnThatIsWiderThanTheScreen) {
  TextTable table({"a", "b"});
  table.AddRow({"1", std::string(50, 'x')});
  EXPECT_THAT(PrintOn(20, table), HasSubstr(std::string(50, 'x')));
}

TEST(FittedTextTable, AlignsPaintedCells) {
  std::ostringstream painted;
  SetScreen(painted, {.columns = 0, .rows = 0, .color = true});
  TextTable table({"verdict", "n"});
  table.AddRow({Paint(painted, Color::kGreen, "good"), "1"});
  std::ostringstream out;
  table.Print(out);
  EXPECT_EQ(out.str(), "verdict  n\n\x1b[32mgood\x1b[0m     1\n");
}

}  // namespace
}  // namespace polyest::internal
