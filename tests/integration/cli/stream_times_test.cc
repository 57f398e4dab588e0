// Tests what `polyest stream` says of a file's rows.

#include <gmock/gmock.h>

#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

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

}  // namespace
}  // namespace polyest::internal
