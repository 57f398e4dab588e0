// Tests the command's errors for bad usage, bad input and bad connections.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <gmock/gmock.h>

#include <algorithm>

#include "polyest/client.h"
#include "tests/integration/cli/command_test.h"

namespace polyest::internal::errors_test {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr char kProblem[] = R"({
  "model": {"builtin": "mass_spring_damper"},
  "fixed": {"m": 1.0, "x0": 1.0},
  "uncertain": [{"name": "k", "uniform": {"lower": 31.584, "upper": 47.376}}],
  "measured": [{"output": "x", "noise": {"absolute": 0.01}}],
  "expansion": {"order": 3}
})";
constexpr char kData[] = "t,x\n0.1,0.8\n0.2,0.3\n";

class ErrorsTest : public CommandTest {
 protected:
  // Returns the good problem with one text replaced.
  static std::string Changed(const std::string& from, const std::string& to) {
    const std::string problem = absl::StrReplaceAll(kProblem, {{from, to}});
    EXPECT_NE(problem, kProblem);
    return problem;
  }

  // Runs an estimate in this process and returns its one line of error.
  std::string Refused(const std::string& problem, const std::string& data) {
    const Finished run = Run({"estimate", File("problem.json", problem), File("data.csv", data)});
    return OneLine(run, 2);
  }

  static std::string OneLine(const Finished& run, int exit_status) {
    EXPECT_EQ(run.exit_status, exit_status) << run.err;
    EXPECT_THAT(run.out, IsEmpty());
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_THAT(run.err, AllOf(StartsWith("polyest: "), EndsWith("\n")));
    return run.err;
  }

  // Returns the address of a server that has gone, so that none is there.
  static std::string GoneAddress() {
    DaemonProcess daemon;
    return daemon.address();
  }
};

TEST_F(ErrorsTest, TheGoodCaseIsGood) {
  EXPECT_EQ(Run({"estimate", File("problem.json", kProblem), File("data.csv", kData)}).exit_status,
            0);
}

TEST_F(ErrorsTest, NamesThatAreMissingOrUnknown) {
  EXPECT_THAT(Refused(Changed("\"name\": \"k\"", "\"name\": \"stiffness\""), kData),
              AllOf(HasSubstr("problem.json: uncertain[0]"), HasSubstr("stiffness"), HasSubstr("k"),
                    HasSubstr("x0")));
  EXPECT_THAT(Refused(Changed("\"name\": \"k\", ", ""), kData),
              HasSubstr("problem.json: uncertain[0]"));
  EXPECT_THAT(Refused(Changed("\"x0\"", "\"y0\""), kData),
              AllOf(HasSubstr("problem.json: fixed.y0"), HasSubstr("v0")));
  EXPECT_THAT(Refused(Changed("mass_spring_damper", "spring"), kData),
              AllOf(HasSubstr("problem.json: model.builtin"), HasSubstr("duffing")));
  EXPECT_THAT(Refused(Changed("\"expansion\"", "\"expnsion\""), kData),
              HasSubstr("problem.json: expnsion: unknown field"));
}

TEST_F(ErrorsTest, AProblemThatIsNotQuiteJson) {
  EXPECT_THAT(
      Refused("{\"fixed\": {\"m\": 1},\n \"uncertain\": [],\n}", kData),
      AllOf(HasSubstr("problem.json:3:1: "), HasSubstr("no comma may follow the last value")));
  EXPECT_THAT(
      Refused("{'fixed': {}}", kData),
      AllOf(HasSubstr("problem.json:1:2: "), HasSubstr("names and texts stand in double quotes")));
}

TEST_F(ErrorsTest, APriorWithoutWidth) {
  EXPECT_THAT(Refused(Changed("\"lower\": 31.584", "\"lower\": 50"), kData),
              AllOf(HasSubstr("problem.json: uncertain[0].uniform: "), HasSubstr("50"),
                    HasSubstr("47.376")));
  EXPECT_THAT(Refused(Changed("\"lower\": 31.584", "\"lower\": 47.376"), kData),
              HasSubstr("problem.json: uncertain[0].uniform: "));
}

TEST_F(ErrorsTest, AnOrderTooHighForMemory) {
  EXPECT_THAT(Refused(Changed("\"order\": 3", "\"order\": 1000000"), kData),
              AllOf(HasSubstr("expansion"), HasSubstr("order")));
}

TEST_F(ErrorsTest, AChannelThatTheModelLacks) {
  EXPECT_THAT(Refused(Changed("\"output\": \"x\"", "\"output\": \"y\""), "t,y\n0,1\n"),
              AllOf(HasSubstr("problem.json: measured[0]"), HasSubstr("y"), HasSubstr("x")));
  EXPECT_THAT(Refused(kProblem, "t,y\n0,1\n"),
              HasSubstr("data.csv:1: no column is a measured output of the problem (x); the file's "
                        "columns are \"t\", \"y\""));
}

TEST_F(ErrorsTest, DataThatAreNoNumbers) {
  EXPECT_THAT(Refused(kProblem, "t,x\n0.1,inf\n"),
              HasSubstr("data.csv:2: column x: \"inf\" must be finite"));
  EXPECT_THAT(Refused(kProblem, "t,x\n0.1,abc\n"),
              HasSubstr("data.csv:2: column x: \"abc\" must be a number"));
}

TEST_F(ErrorsTest, TimesThatGoBack) {
  EXPECT_THAT(Refused(kProblem, "t,x\n0.2,1\n0.1,1\n"),
              HasSubstr("data.csv:3: column t: 0.1 must be later than 0.2 of the row before"));
}

TEST_F(ErrorsTest, EmptyFiles) {
  EXPECT_THAT(Refused(kProblem, ""), HasSubstr("data.csv: is empty"));
  EXPECT_THAT(Refused("", kData), HasSubstr("problem.json: is empty"));
  EXPECT_THAT(Refused(kProblem, "t,x\n"), HasSubstr("data.csv: has no rows"));
}

TEST_F(ErrorsTest, FilesThatAreNotThere) {
  EXPECT_THAT(OneLine(Run({"estimate", "/nowhere/p.json", "/nowhere/d.csv"}), 2),
              HasSubstr("/nowhere/p.json: cannot be opened"));
}

// The problem is not there either: the file to write is tried first.
TEST_F(ErrorsTest, FilesThatCannotBeWrittenBeforeAnythingIsRead) {
  for (const char* const command : {"estimate", "fit", "posterior", "profile", "regularization"}) {
    EXPECT_EQ(OneLine(Run({command, "p.json", "d.csv", "--plot", "/nowhere/plot.svg"}), 1),
              "polyest: --plot: cannot write /nowhere/plot.svg: No such file or directory\n")
        << command;
  }
  EXPECT_EQ(OneLine(Run({"report", "p.json", "d.csv", "-o", "/nowhere/r.html"}), 1),
            "polyest: --output: cannot write /nowhere/r.html: No such file or directory\n");
  EXPECT_EQ(OneLine(Run({"report", "p.json", "d.csv", "-o", folder_}), 1),
            "polyest: --output: cannot write " + folder_.string() + ": Is a directory\n");
  const std::string problem = File("p.json", kProblem);
  EXPECT_EQ(OneLine(Run({"report", problem, File("d.csv", kData), "-o", "/dev/full"}), 1),
            "polyest: --output: cannot write /dev/full: No space left on device\n");
}

TEST_F(ErrorsTest, FoldersInPlaceOfFiles) {
  const std::string problem = File("p.json", kProblem);
  const std::string data = File("d.csv", kData);
  const std::string folder = folder_;
  const std::string refusal = "polyest: " + folder + ": is a folder, not a file\n";
  EXPECT_EQ(OneLine(Run({"estimate", problem, folder}), 2), refusal);
  EXPECT_EQ(OneLine(Run({"estimate", folder, data}), 2), refusal);
  EXPECT_EQ(OneLine(Run({"stream", problem, folder, "--server", "a:1"}), 2), refusal);
  EXPECT_EQ(OneLine(Run({"init", "--from", folder}), 2), refusal);
}

TEST_F(ErrorsTest, ColumnsThatFitNoModel) {
  EXPECT_THAT(OneLine(Run({"init", "--from", File("d.csv", "t,foo,bar [kg]\n0,1,2\n")}), 2),
              HasSubstr("d.csv: no model fits these columns: \"foo\", \"bar [kg]\"; "));
}

TEST_F(ErrorsTest, TheDaemonSaysTheSame) {
  DaemonProcess daemon;
  const std::string problem = File("p.json", Changed("\"lower\": 31.584", "\"lower\": 50"));
  const std::string data = File("d.csv", kData);
  const std::string local = OneLine(Run({"estimate", problem, data}), 2);
  EXPECT_EQ(OneLine(Run({"estimate", problem, data, "--server", daemon.address()}), 2), local);
  EXPECT_EQ(OneLine(Run({"stream", problem, data, "--server", daemon.address()}), 2), local);
}

TEST_F(ErrorsTest, AMessageTooLarge) {
  DaemonProcess daemon({"--max-message-mb", "1"});
  // Each row has two doubles: the record is a little longer than 1 MiB.
  std::string data = "t,x\n";
  for (int i = 1; i <= 70'000; ++i) absl::StrAppend(&data, i, ",0\n");
  const std::string problem = File("p.json", kProblem);
  const std::string file = File("d.csv", data);
  for (const std::vector<std::string>& command : {std::vector<std::string>{"estimate"},
                                                  {"explain"},
                                                  {"posterior"},
                                                  {"profile"},
                                                  {"regularization"},
                                                  {"cost"},
                                                  {"design", "--until", "1"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {problem, file, "--server", daemon.address()});
    // Warnings of the data, which never change, stand before the error.
    const Finished run = Run(arguments);
    EXPECT_EQ(run.exit_status, 3) << command[0];
    EXPECT_THAT(Lines(run.err).back(),
                AllOf(HasSubstr(daemon.address()), HasSubstr("larger than max"),
                      HasSubstr("raise the daemon's --max-message-mb, or use polyest stream")))
        << command[0];
  }
}

TEST_F(ErrorsTest, AProblemTooLarge) {
  DaemonProcess daemon({"--max-states", "1"});
  const std::string problem = File("p.json", kProblem);
  const std::string data = File("d.csv", kData);
  const std::string line =
      OneLine(Run({"estimate", problem, data, "--server", daemon.address()}), 3);
  EXPECT_THAT(line, AllOf(HasSubstr("(--max-states)"), Not(HasSubstr("streamed"))));
  EXPECT_EQ(OneLine(Run({"stream", problem, data, "--server", daemon.address()}), 3), line);
}

TEST_F(ErrorsTest, ASessionThatDoesNotExist) {
  DaemonProcess daemon;
  Client client(daemon.address());
  v1::GetSessionRequest request;
  request.set_name("sessions/nowhere");
  const auto session = client.GetSession(request);
  EXPECT_EQ(session.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(session.status().message(), HasSubstr("nowhere"));
}

TEST_F(ErrorsTest, ASessionNameThatIsNone) {
  DaemonProcess daemon;
  EXPECT_THAT(OneLine(Run({"stream", File("p.json", kProblem), File("d.csv", kData), "--server",
                           daemon.address(), "--session", "No Name"}),
                      2),
              HasSubstr("No Name"));
}

TEST_F(ErrorsTest, AServerThatCannotBeReached) {
  const std::string gone = GoneAddress();
  const std::string problem = File("p.json", kProblem);
  const std::string data = File("d.csv", kData);
  for (const char* const command : {"estimate", "stream"}) {
    EXPECT_THAT(OneLine(Run({command, problem, data, "--server", gone}), 3),
                HasSubstr(absl::StrCat("server ", gone)));
  }
  EXPECT_THAT(OneLine(Run({"models", "--server", gone}), 3), HasSubstr(gone));
}

TEST_F(ErrorsTest, ADeadlineThatPasses) {
  DaemonProcess daemon;
  // The answer has nearly as many numbers as allowed: no daemon computes them in a millisecond.
  EXPECT_THAT(OneLine(Run({"propagate", File("p.json", kProblem), "--until", "700", "--step",
                           "0.001", "--server", daemon.address(), "--deadline", "0.001"}),
                      3),
              HasSubstr("eadline"));
}

TEST_F(ErrorsTest, ADeadlineOfAStreamThatWaitsForTheTimeOfItsRows) {
  DaemonProcess daemon;
  const std::string slow = File("slow.csv", "t,x\n0.1,0.8\n1000,0.3\n");
  const Finished run = Run({"stream", File("p.json", kProblem), slow, "--batch", "1", "--rate", "1",
                            "--server", daemon.address(), "--deadline", "0.5"});
  EXPECT_EQ(run.exit_status, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("eadline"));
}

TEST_F(ErrorsTest, AnUnknownModelOrFigure) {
  EXPECT_THAT(OneLine(Run({"models", "spring"}), 2), HasSubstr("duffing"));
  const Finished figure = Run({"paper", "99"});
  EXPECT_EQ(figure.exit_status, 2);
  EXPECT_THAT(figure.out, IsEmpty());
  EXPECT_THAT(figure.err, HasSubstr("99"));
}

TEST_F(ErrorsTest, AVehicleThatComesToAStop) {
  const std::string problem = File("p.json", R"({
    "model": {"builtin": "bicycle"},
    "uncertain": [{"name": "Cf", "uniform": {"lower": 6e4, "upper": 1e5}}],
    "inputs": [{"name": "vx", "streamed": {}}, {"name": "delta", "constant": {"amplitude": 0.01}}],
    "measured": [{"output": "r", "noise": {"absolute": 0.005}}]
  })");
  const std::string data = File("d.csv", "t,vx,r\n0,10,0\n1,5,0.02\n2,0,0\n3,0,0\n");
  EXPECT_THAT(OneLine(Run({"estimate", problem, data}), 2),
              AllOf(HasSubstr("only 0 of"), HasSubstr("could be integrated")));
}

TEST_F(ErrorsTest, StudiesThatCannotBeMade) {
  const std::string problem = File("p.json", kProblem);
  for (const char* const command : {"sensitivity", "design"}) {
    EXPECT_THAT(OneLine(Run({command, problem}), 2), HasSubstr("--until"));
    EXPECT_THAT(OneLine(Run({command, problem, "--until", "0"}), 2), HasSubstr("--until: 0"));
    EXPECT_THAT(OneLine(Run({command, problem, "--until", "1", "--step", "-1"}), 2),
                HasSubstr("--step: -1"));
    EXPECT_THAT(OneLine(Run({command, problem, "--until", "1", "--outputs", "x,q"}), 2),
                AllOf(HasSubstr("\"q\""), HasSubstr("x, v, a")));
    EXPECT_THAT(OneLine(Run({command, problem, "--until", "1", "--outputs", "x,K[1,1]"}), 2),
                HasSubstr("\"K[1,1]\""));
  }
  EXPECT_THAT(OneLine(Run({"sensitivity", Example("damper_rig.json"), "--until", "1"}), 2),
              HasSubstr("correlations: m and k1"));
  const std::string streamed = Example("quarter_car.json");
  EXPECT_THAT(OneLine(Run({"design", streamed, "--until", "1"}), 2),
              HasSubstr("inputs: road is streamed, but this study needs inputs that are known in "
                        "advance; replace its \"streamed\" by a \"table\""));
  const std::string other = File("other.json", R"({"inputs": [{"name": "wind"}]})");
  EXPECT_THAT(OneLine(Run({"design", problem, "--until", "1", "--candidate", other}), 2),
              HasSubstr("polyest: " + other + ": inputs[0]"));
  EXPECT_THAT(OneLine(Run({"design", problem, "--until", "1", "--candidate", "absent.json"}), 2),
              HasSubstr("absent.json"));
}

TEST_F(ErrorsTest, AnOptionThatIsRefusedIsNotBlamedOnAFile) {
  const std::string problem = File("p.json", kProblem);
  const std::string data = File("d.csv", kData);
  EXPECT_THAT(OneLine(Run({"posterior", problem, data, "--quantiles", "2"}), 2),
              StartsWith("polyest: --quantiles: 2 must"));
  EXPECT_THAT(OneLine(Run({"posterior", problem, data, "--joint", "k,c,d"}), 2),
              HasSubstr("\"k,c,d\" must be two parameters"));
  EXPECT_THAT(OneLine(Run({"posterior", problem, data, "--joint", "k,K[1,1]"}), 2),
              AllOf(StartsWith("polyest: --joint: "), HasSubstr("K[1,1]")));
  EXPECT_THAT(OneLine(Run({"design", problem, "--until", "0"}), 2),
              StartsWith("polyest: --until: 0 must"));
  DaemonProcess daemon;
  EXPECT_THAT(
      OneLine(Run({"stream", problem, data, "--server", daemon.address(), "--session", "No Name"}),
              2),
      StartsWith("polyest: --session: "));
}

TEST_F(ErrorsTest, BadUsage) {
  const std::string problem = File("p.json", kProblem);
  const std::string data = File("d.csv", kData);
  OneLine(Run({}), 2);
  OneLine(Run({"estmate"}), 2);
  EXPECT_THAT(OneLine(Run({"estimate", problem}), 2), HasSubstr("data"));
  EXPECT_THAT(OneLine(Run({"estimate", problem, data, "--format", "xml"}), 2),
              AllOf(HasSubstr("xml"), HasSubstr("table, json")));
  EXPECT_THAT(OneLine(Run({"estimate", problem, data, "--format", "jsonl"}), 2),
              HasSubstr("jsonl"));
  EXPECT_THAT(OneLine(Run({"estimate", problem, data, "--local", "--server", "a:1"}), 2),
              HasSubstr("--local"));
  for (const char* const server : {"host", "host:", "host:0", "host:70000", ":1", "host:1x"}) {
    EXPECT_THAT(OneLine(Run({"estimate", problem, data, "--server", server}), 2),
                HasSubstr("HOST:PORT"));
  }
  for (const char* const server : {"http://rig:50051", "https://127.0.0.1:8080"}) {
    EXPECT_THAT(OneLine(Run({"estimate", problem, data, "--server", server}), 2),
                HasSubstr("without \"http://\" or a path"));
  }
  for (const char* const server : {"::1", "::1:50051", "2001:db8::1:50051", "fe80::1%eth0:50051"}) {
    EXPECT_THAT(OneLine(Run({"estimate", problem, data, "--server", server}), 2),
                HasSubstr("an IPv6 address in brackets, as in [::1]:50051"));
  }
  EXPECT_THAT(OneLine(Run({"stream", problem, data}), 2), HasSubstr("--server"));
  for (const char* const batch : {"0", "-1", "x"}) {
    EXPECT_THAT(OneLine(Run({"stream", problem, data, "--server", "a:1", "--batch", batch}), 2),
                HasSubstr("--batch"));
  }
  OneLine(Run({"stream", problem, data, "--server", "a:1", "--rate", "-1"}), 2);
  OneLine(Run({"propagate", problem, "--until", "1"}), 2);
  OneLine(Run({"propagate", problem, "--until", "1", "--step", "0"}), 2);
  OneLine(Run({"propagate", problem, "--until", "nan", "--step", "1"}), 2);
  EXPECT_THAT(OneLine(Run({"cost", problem, data, "--grid", "1"}), 2),
              HasSubstr("--grid: 1 must be 0 or 2 to 1001"));
  EXPECT_THAT(Run({"cost", "--help"}).out, HasSubstr("0 (default) or 2 to 1001"));
}

}  // namespace
}  // namespace polyest::internal::errors_test
