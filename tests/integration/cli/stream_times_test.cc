// Tests what `polyest stream` says of the rows of its data and how it takes times that are dates.

#include <gmock/gmock.h>

#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class StreamTimesTest : public CommandTest {
 protected:
  std::vector<std::string> Command(const std::string& data,
                                   const std::vector<std::string>& options) const {
    std::vector<std::string> arguments = {"stream", Example("oscillator.json"), data, "--server",
                                          daemon_.address()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return arguments;
  }

  DaemonProcess daemon_;
};

TEST_F(StreamTimesTest, SaysThatItKnowsTheFirstRowsOnlyWhenItBegins) {
  std::string rows = DemoRows(40);
  rows.replace(rows.find("x"), 1, "x [m]");
  const std::string data = File("d.csv", rows);
  EXPECT_THAT(Run(Command(data, {"--batch", "10"})).err,
              HasSubstr("d.csv: 'x [m]' → x; the first 10 rows from 0.05 s"));
  EXPECT_THAT(Run(Command(data, {"--batch", "50"})).err,
              HasSubstr("d.csv: 'x [m]' → x; 40 rows from 0.05 s"));
}

TEST_F(StreamTimesTest, ResumesWithDatesOnlyFromTheFirstRowOfTheSession) {
  const std::string header = "time,run,x\n";
  const std::string begin = "2026-01-31T10:00:00,0,1\n2026-01-31T10:00:01,0,0.9\n";
  const std::string end = "2026-01-31T10:00:02,0,0.5\n2026-01-31T10:00:03,0,0.4\n";
  const std::vector<std::string> options = {"--session", "rig-1", "--format", "jsonl"};
  ASSERT_EQ(Run(Command(File("a.csv", header + begin), options)).exit_status, 0);
  const Finished rest = Run(Command(File("b.csv", header + end), options));
  EXPECT_EQ(rest.exit_status, 2);
  EXPECT_EQ(rest.out, "");
  EXPECT_THAT(rest.err, AllOf(HasSubstr("b.csv: its times count from its first row"),
                              HasSubstr("sessions/rig-1 counts those of run 0 from another row")));
  const Finished whole = Run(Command(File("c.csv", header + begin + end), options));
  ASSERT_EQ(whole.exit_status, 0) << whole.err;
  EXPECT_EQ(ParseEstimate(Lines(whole.out).back()).samples(), 4);
  EXPECT_EQ(ParseEstimate(Lines(whole.out).back()).time(), 3);
  const std::string next = header + "2026-01-31T11:00:00,1,1\n2026-01-31T11:00:01,1,0.9\n";
  const Finished run = Run(Command(File("d.csv", next), options));
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_EQ(ParseEstimate(Lines(run.out).back()).samples(), 6);
}

TEST_F(StreamTimesTest, KeepsTheRowsBeforeABadOneInItsFirstBatchToo) {
  const Finished run = Run(Command("-", {"--session", "rig-1"}), DemoRows(1) + "0.05,many\n");
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(run.err, HasSubstr("standard input:3: column x: \"many\" must be a number; "
                                 "sessions/rig-1 has kept the row sent before"));
}

TEST_F(StreamTimesTest, CreatesNoSessionForDataWithoutAnyValidRow) {
  const Finished run = Run(Command("-", {"--session", "rig-1"}), "t,x\n0,many\n");
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(Run({"list", "--server", daemon_.address()}).out, testing::Not(HasSubstr("rig-1")));
}

}  // namespace
}  // namespace polyest::internal
