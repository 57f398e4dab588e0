// Tests the command's answers to misspelt words, and its help.

#include <gmock/gmock.h>

#include <regex>

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

TEST_F(UsageTest, RefusesWhatIsSaidOfNoDataFile) {
  const std::vector<std::string> session = {"--session", "s", "--server", "rig:50051"};
  const auto refused = [](std::vector<std::string> arguments,
                          const std::vector<std::string>& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Refused(arguments);
  };
  EXPECT_EQ(refused({"report", "--time-column", "T"}, session),
            "polyest: report: --time-column requires data; see polyest report --help\n");
  EXPECT_THAT(refused({"fit", "--time-zero", "first"}, session),
              HasSubstr("--time-zero requires data or --validate; see"));
  EXPECT_THAT(Refused({"design", "p.json", "--until", "1", "--delimiter", "tab"}),
              HasSubstr("--delimiter requires data; see"));
  EXPECT_THAT(Refused({"check", "p.json", "--decimal", "comma"}),
              HasSubstr("--decimal requires data; see"));
  EXPECT_THAT(Refused({"init", "duffing", "--date-order", "dmy"}),
              HasSubstr("--date-order requires --from; see"));
  // The other record may need it.
  const Finished unreachable = Run({"fit", "--validate", "d.csv", "--time-zero", "first",
                                    "--session", "s", "--server", "127.0.0.1:1"});
  EXPECT_EQ(unreachable.exit_status, 3) << unreachable.err;
}

TEST_F(UsageTest, TakesNoFileForAFurtherQuantile) {
  for (const std::vector<std::string>& options : std::vector<std::vector<std::string>>{
           {"posterior", "--quantiles", "0.5"},
           {"posterior", "--quantiles", "0.5,0.9", "--quantiles", "0.1"},
           {"posterior", "--joint", "k,c"},
           {"fit", "--outputs", "x"},
           {"fit", "--quantiles", "0.5"},
           {"profile", "--parameter", "k"},
           {"cost", "--parameter", "k"}}) {
    std::vector<std::string> arguments = options;
    arguments.insert(arguments.end(), {"no.json", "no.csv"});
    EXPECT_THAT(Refused(arguments), HasSubstr("no.json: cannot be opened")) << options[1];
  }
  EXPECT_THAT(Refused({"design", "--until", "1", "--candidate", "other.json", "no.json"}),
              HasSubstr("no.json: cannot be opened"));
}

TEST_F(UsageTest, SaysThatThereAreFewerTimesThanToBeChosen) {
  const Finished run = Run(
      {"design", Example("oscillator.json"), "--until", "1", "--step", "0.25", "--samples", "9"});
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_EQ(
      run.err,
      "polyest: --samples: there are only 4 possible sample times, all of which are chosen; a "
      "smaller --step allows more\n");
}

TEST_F(UsageTest, SaysThatTheHelpCouldNotBeWritten) {
  for (const char* const words : {"--help", "--version", "estimate --help"}) {
    const Finished run =
        RunProgram({"/bin/sh", "-c", std::string(POLYEST_PROGRAM) + " " + words + " >/dev/full"});
    EXPECT_EQ(run.exit_status, 1) << words;
    EXPECT_EQ(run.err, "polyest: the output could not be written\n");
  }
}

// What the help says becomes man pages, which serve other computers.
TEST_F(UsageTest, SaysNothingOfThisComputerInItsHelp) {
  EXPECT_THAT(Run({"estimate", "--help"}).out, HasSubstr("(default: one for each core)"));
  EXPECT_FALSE(std::regex_search(Run({"estimate", "--help"}).out, std::regex("--threads[^\n]*=")));
}

TEST_F(UsageTest, CompletesTheWordsOfEveryOption) {
  const auto completed = [](const std::string& option) {
    const std::string words = "source " POLYEST_SOURCE_DIR
                              "/deploy/completion/polyest.bash; COMP_WORDS=(" POLYEST_PROGRAM
                              " estimate " +
                              option + " ''); COMP_CWORD=3; _polyest; echo \"${COMPREPLY[*]}\"";
    return RunProgram({"/bin/bash", "-c", words}).out;
  };
  EXPECT_EQ(completed("--format"), "table json\n");
  EXPECT_EQ(completed("--delimiter"), "bar comma semicolon tab\n");
  EXPECT_EQ(completed("--decimal"), "comma point\n");
  EXPECT_EQ(completed("--time-zero"), "file first\n");
  EXPECT_EQ(completed("--date-order"), "dmy mdy\n");
  EXPECT_EQ(completed("--threads"), "\n");
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
