// Tests the command's answers to misspelt words, and its help.

#include <gmock/gmock.h>

#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class UsageTest : public CommandTest {
 protected:
  static std::string Refused(const std::vector<std::string>& arguments) {
    const Finished run = Run(arguments);
    EXPECT_EQ(run.exit_status, 2) << run.err;
    EXPECT_THAT(run.out, IsEmpty());
    EXPECT_EQ(Lines(run.err).size(), 1u) << run.err;
    return run.err;
  }
};

TEST_F(UsageTest, ProposesTheNearestCommand) {
  EXPECT_EQ(Refused({"estimat", "p.json", "d.csv"}),
            "polyest: there is no command \"estimat\"; did you mean \"estimate\"? See polyest "
            "--help\n");
  EXPECT_THAT(Refused({"banana"}), AllOf(HasSubstr("the commands are estimate, explain, "),
                                         HasSubstr("; see polyest --help")));
}

TEST_F(UsageTest, ProposesTheNearestOption) {
  EXPECT_EQ(Refused({"estimate", "p.json", "d.csv", "--sevrer", "rig:50051"}),
            "polyest: estimate: there is no option \"--sevrer\"; did you mean \"--server\"?; see "
            "polyest estimate --help\n");
  EXPECT_THAT(Refused({"estimate", "p.json", "d.csv", "--fromat=json"}),
              HasSubstr("did you mean \"--format\"?"));
  // The unknown option is named before the one that is missing because of it.
  EXPECT_THAT(Refused({"stream", "p.json", "d.csv", "--sever", "rig:50051"}),
              HasSubstr("did you mean \"--server\"?"));
  EXPECT_THAT(Refused({"estimate", "p.json", "d.csv", "--banana"}),
              HasSubstr("there is no option \"--banana\"; see"));
}

TEST_F(UsageTest, SaysThatTheFilesAreSwapped) {
  const std::string problem = Example("oscillator.json");
  const std::string data = Example("oscillator.csv");
  for (const char* const command :
       {"estimate", "explain", "posterior", "profile", "regularization", "cost", "check"}) {
    EXPECT_THAT(Run({command, data, problem}).err,
                HasSubstr("the first file, " + data + ", is CSV data and the second, " + problem +
                          ", a problem: swap them"))
        << command;
  }
  EXPECT_THAT(Refused({"stream", data, problem, "--server", "127.0.0.1:1"}),
              HasSubstr("swap them"));
  EXPECT_THAT(Refused({"design", data, problem, "--until", "1"}), HasSubstr("swap them"));
  EXPECT_THAT(Refused({"estimate", problem, problem}),
              HasSubstr("oscillator.json: is JSON; data are CSV"));
  EXPECT_THAT(Refused({"estimate", data, data}),
              HasSubstr("oscillator.csv: is CSV data; a problem"));
}

TEST_F(UsageTest, SaysWhatANumberMustBe) {
  const auto refused = [](const std::string& command, const std::string& option,
                          const std::string& value) {
    return Refused({command, "p.json", "d.csv", option, value});
  };
  EXPECT_THAT(refused("regularization", "--lowest", "0"),
              HasSubstr("--lowest: 0 must be a number from 1e-08 to 1e+08; see"));
  EXPECT_THAT(refused("fit", "--draws", "2.5"),
              HasSubstr("--draws: 2.5 must be a whole number from 2 to 10000; see"));
  EXPECT_THAT(refused("posterior", "--quantiles", "half"),
              HasSubstr("--quantiles: half must be a number; see"));
  EXPECT_THAT(refused("estimate", "--deadline", "nan"),
              HasSubstr("--deadline: nan must be a number from 0 to 1e+09; see"));
}

TEST_F(UsageTest, RefusesThreadsOfThisProcessForADaemon) {
  EXPECT_THAT(Refused({"estimate", "p.json", "d.csv", "--threads", "2", "--server", "rig:50051"}),
              HasSubstr("--server excludes --threads"));
}

TEST_F(UsageTest, GroupsTheCommandsByPurpose) {
  const Finished help = Run({"--help"});
  ASSERT_EQ(help.exit_status, 0);
  size_t place = 0;
  for (const char* const text :
       {"Estimate:", "estimate", "posterior", "Before you measure:", "check", "design",
        "Sessions:", "stream", "watch", "list", "Daemon:", "top", "Other:", "paper"}) {
    const size_t next = help.out.find(text, place);
    ASSERT_NE(next, std::string::npos) << text << "\n" << help.out;
    place = next;
  }
}

TEST_F(UsageTest, EveryCommandHasAnExampleThatItWouldTake) {
  for (const std::string& line : Lines(Run({"--help"}).out)) {
    if (line.rfind("  ", 0) != 0 || line[2] == ' ' || line[2] == '-') continue;
    const std::string command = line.substr(2, line.find(' ', 2) - 2);
    const Finished help = Run({command, "--help"});
    ASSERT_EQ(help.exit_status, 0) << command;
    EXPECT_THAT(help.out, AllOf(HasSubstr("Examples:\n"), HasSubstr("\n  polyest " + command)))
        << command;
  }
}

}  // namespace
}  // namespace polyest::internal
