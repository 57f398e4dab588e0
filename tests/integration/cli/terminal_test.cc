// Tests the command on a terminal: widths, colours, keys and progress.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <algorithm>

#include "client/cli/screen.h"
#include "tests/integration/cli/command_test.h"
#include "tests/integration/cli/terminal.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kClearScreen[] = "\x1b[H\x1b[J";

class TerminalTest : public CommandTest {
 protected:
  // Returns everything that a command sends to a terminal.
  static std::string OnTerminal(std::vector<std::string> arguments, TerminalProcess::Size size,
                                const std::vector<std::string>& environment = {}) {
    arguments.insert(arguments.begin(), POLYEST_PROGRAM);
    TerminalProcess process(arguments, size, environment);
    const std::string sent = process.ReadAll();
    EXPECT_EQ(process.Wait(), 0) << sent;
    return sent;
  }

  static int LongestLine(const std::string& text) {
    int longest = 0;
    for (const std::string& line : Lines(text)) longest = std::max(longest, DisplayWidth(line));
    return longest;
  }

  std::vector<std::string> EstimateCommand() const {
    return {"estimate", Example("oscillator.json"), File("d.csv", DemoRows(60))};
  }
};

TEST_F(TerminalTest, TablesAreAsWideAsTheTerminal) {
  for (const int columns : {60, 80}) {
    const std::string text = PlainText(OnTerminal(EstimateCommand(), {.columns = columns}));
    EXPECT_LE(LongestLine(text), columns) << text;
    EXPECT_THAT(text, AllOf(HasSubstr("estimate ± sd"), HasSubstr("verdict")));
  }
  EXPECT_LE(LongestLine(PlainText(OnTerminal(EstimateCommand(), {.columns = 200}, {"COLUMNS=60"}))),
            60);
  const Finished piped = Run(EstimateCommand());
  EXPECT_GT(LongestLine(piped.out), 80);
}

TEST_F(TerminalTest, VerdictsHaveColoursUnlessTheyAreNotWanted) {
  const std::string green = "\x1b[32midentified\x1b[0m";
  EXPECT_THAT(OnTerminal(EstimateCommand(), {.columns = 120}), HasSubstr(green));
  EXPECT_THAT(OnTerminal(EstimateCommand(), {.columns = 120}, {"NO_COLOR=1"}),
              Not(HasSubstr("\x1b[3")));
  EXPECT_THAT(OnTerminal(EstimateCommand(), {.columns = 120}, {"TERM=dumb"}),
              Not(HasSubstr("\x1b[3")));
  std::vector<std::string> never = EstimateCommand();
  never.insert(never.end(), {"--color", "never"});
  EXPECT_THAT(OnTerminal(never, {.columns = 120}), Not(HasSubstr("\x1b[3")));
  std::vector<std::string> always = EstimateCommand();
  EXPECT_THAT(Run(always).out, Not(HasSubstr("\x1b")));
  always.insert(always.end(), {"--color", "always"});
  EXPECT_THAT(Run(always).out, HasSubstr(green));
  always.insert(always.end(), {"--format", "json"});
  EXPECT_THAT(Run(always).out, Not(HasSubstr("\x1b")));
}

TEST_F(TerminalTest, SaysHowFarAStreamIsAndTakesItAwayAtTheEnd) {
  DaemonProcess daemon;
  // The pipe gives no data, so that the progress line comes however long it takes.
  const std::string pipe = (folder_ / "pipe").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  TerminalProcess stream(
      {POLYEST_PROGRAM, "stream", Example("oscillator.json"), pipe, "--server", daemon.address()},
      {.columns = 100});
  const int writer = open(pipe.c_str(), O_WRONLY | O_CLOEXEC);
  ASSERT_GE(writer, 0);
  EXPECT_THAT(stream.ReadUntil("waiting for data"), HasSubstr("waiting for data · "));
  const std::string rows = DemoRows(60);
  ASSERT_EQ(write(writer, rows.data(), rows.size()), static_cast<ssize_t>(rows.size()));
  EXPECT_THAT(stream.ReadUntil("row 60 sent, estimate"),
              HasSubstr("row 60 sent, estimate up to t = "));
  close(writer);
  const std::string sent = stream.ReadAll();
  EXPECT_EQ(stream.Wait(), 0);
  // The progress line is cleared before the table.
  const std::string last_line = sent.substr(sent.rfind("sent, estimate"));
  EXPECT_THAT(last_line, HasSubstr("\r\x1b[K"));
}

TEST_F(TerminalTest, AnEstimateInThisProcessSaysHowFarItIs) {
  std::string data = "t,x\n";
  for (int i = 1; i <= 300'000; ++i) data += std::to_string(0.05 * i) + ",0.1\n";
  TerminalProcess estimate(
      {POLYEST_PROGRAM, "estimate", Example("oscillator.json"), File("long.csv", data)},
      {.columns = 100});
  EXPECT_THAT(estimate.ReadUntil(" of 300000 · "), HasSubstr(" of 300000 · "));
  // Ctrl-C ends the command, which has shown its progress but no answer yet.
  estimate.Signal(SIGINT);
  EXPECT_EQ(estimate.Wait(), 128 + SIGINT);
}

class TopTerminalTest : public TerminalTest {
 protected:
  std::unique_ptr<TerminalProcess> StartTop() {
    auto top = std::make_unique<TerminalProcess>(
        std::vector<std::string>{POLYEST_PROGRAM, "top", "--server", daemon_.address(),
                                 "--interval", "0.1"},
        TerminalProcess::Size{.columns = 80, .rows = 24});
    EXPECT_THAT(top->ReadUntil("press q to quit"), HasSubstr(kClearScreen));
    EXPECT_FALSE(top->InLineMode());
    return top;
  }

  DaemonProcess daemon_;
};

TEST_F(TopTerminalTest, FitsEightyColumns) {
  ASSERT_EQ(Run({"stream", Example("oscillator.json"), File("d.csv", DemoRows(60)), "--server",
                 daemon_.address(), "--session", "a-name-of-some-length-on-the-rig"})
                .exit_status,
            0);
  const auto top = StartTop();
  const std::string sent = top->ReadUntil("a-name");
  const std::string text = PlainText(sent);
  EXPECT_LE(LongestLine(text), 80) << text;
  EXPECT_THAT(text, AllOf(HasSubstr("a-name"), HasSubstr("samples"), HasSubstr("real-time")));
}

TEST_F(TopTerminalTest, EndsOnQ) {
  const auto top = StartTop();
  top->Type("xq");
  top->ReadAll();
  EXPECT_EQ(top->Wait(), 0);
  EXPECT_TRUE(top->InLineMode());
}

TEST_F(TopTerminalTest, EndsOnCtrlC) {
  const auto top = StartTop();
  top->Type("\x03");
  top->ReadAll();
  EXPECT_EQ(top->Wait(), 0);
  EXPECT_TRUE(top->InLineMode());
}

TEST_F(TopTerminalTest, RestoresTheTerminalWhenItIsEnded) {
  for (const int signal_number : {SIGTERM, SIGHUP, SIGQUIT}) {
    const auto top = StartTop();
    top->Signal(signal_number);
    top->ReadAll();
    EXPECT_EQ(top->Wait(), 128 + signal_number);
    EXPECT_TRUE(top->InLineMode());
  }
}

TEST_F(TopTerminalTest, RestoresTheTerminalWhenTheDaemonGoes) {
  const auto top = StartTop();
  daemon_.Kill();
  top->ReadAll();
  EXPECT_EQ(top->Wait(), 3);
  EXPECT_TRUE(top->InLineMode());
}

}  // namespace
}  // namespace polyest::internal
