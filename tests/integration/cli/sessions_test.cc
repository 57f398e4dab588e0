// Tests the commands that show the sessions of a daemon.

#include <gmock/gmock.h>

#include "polyest/client.h"
#include "polyest/problem_file.h"
#include "polyest/v1/session_service.pb.h"
#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

class SessionsTest : public CommandTest {
 protected:
  Finished Stream(const std::string& session, int rows = 60) {
    return Run({"stream", Example("oscillator.json"), File("d.csv", DemoRows(rows)), "--server",
                daemon_.address(), "--session", session, "--format", "jsonl"});
  }

  // Runs a command with the daemon's address.
  Finished Ask(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--server", daemon_.address()});
    return Run(std::move(arguments));
  }

  DaemonProcess daemon_;
};

TEST_F(SessionsTest, AreListed) {
  EXPECT_EQ(Lines(Ask({"list"}).out).size(), 1u);
  ASSERT_EQ(Stream("rig-1").exit_status, 0);
  ASSERT_EQ(Stream("rig-2", 30).exit_status, 0);
  const Finished list = Ask({"list"});
  ASSERT_EQ(list.exit_status, 0) << list.err;
  const auto lines = Lines(list.out);
  ASSERT_EQ(lines.size(), 3u) << list.out;
  EXPECT_THAT(lines[0], StartsWith("session"));
  EXPECT_THAT(lines[1], MatchesRegex("rig-1 +2 +60 +[0-9.]+ +0 +in memory +[0-9]+ s +"
                                     "[0-9]+-[0-9]+-[0-9]+ [0-9:]+Z"));
  EXPECT_THAT(lines[2], MatchesRegex("rig-2 .* 1 +30 .*"));
}

TEST_F(SessionsTest, AreListedAsJson) {
  ASSERT_EQ(Stream("rig-1").exit_status, 0);
  const Finished list = Ask({"list", "--format", "json"});
  v1::ListSessionsResponse response;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(list.out, &response).ok()) << list.out;
  ASSERT_EQ(response.sessions_size(), 1);
  EXPECT_EQ(response.sessions(0).name(), "sessions/rig-1");
  EXPECT_EQ(response.sessions(0).sample_count(), 60);
}

TEST_F(SessionsTest, AreWatched) {
  ASSERT_EQ(Stream("rig", 30).exit_status, 0);
  Process watch(
      {POLYEST_PROGRAM, "watch", "rig", "--server", daemon_.address(), "--format", "jsonl"});
  EXPECT_EQ(ParseEstimate(watch.ReadLine()).samples(), 30);
  ASSERT_EQ(Stream("rig", 60).exit_status, 0);
  EXPECT_EQ(ParseEstimate(watch.ReadLine()).samples(), 60);
  watch.Signal(SIGINT);
  EXPECT_EQ(watch.ReadAll(), "");
  EXPECT_EQ(watch.Wait(), 0) << watch.Errors();
}

TEST_F(SessionsTest, AreWatchedForTheirPresentEstimate) {
  const Finished stream = Stream("rig");
  ASSERT_EQ(stream.exit_status, 0);
  EXPECT_EQ(Ask({"watch", "rig", "--once", "--format", "jsonl"}).out,
            Lines(stream.out).back() + "\n");
  const Finished table = Ask({"watch", "rig", "--once"});
  EXPECT_THAT(table.out, StartsWith("60 samples up to t = "));
}

TEST_F(SessionsTest, HaveNoPresentEstimateBeforeTheFirstSample) {
  Client client(daemon_.address());
  const auto problem = ReadProblemFile(Example("oscillator.json"));
  ASSERT_TRUE(problem.ok()) << problem.status();
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_problem() = *problem;
  create.set_session_id("rig");
  ASSERT_TRUE(client.CreateSession(create).ok());
  const Finished watch = Ask({"watch", "rig", "--once"});
  EXPECT_EQ(watch.exit_status, 2);
  EXPECT_EQ(watch.out, "");
  EXPECT_EQ(watch.err, "polyest: sessions/rig has no estimate yet: no sample has arrived\n");
}

TEST_F(SessionsTest, ArePresentedByTheirPriorWhileTheirFirstRowsWait) {
  // The cubic interpolation of the input waits for its later values.
  const std::string problem = File("p.json", R"({
    "model": {"builtin": "linear_two_state"},
    "uncertain": [{"name": "theta", "normal": {"mean": 1, "stdDev": 0.2}}],
    "measured": [{"output": "x1_minus_x2", "noise": {"absolute": 0.01}}],
    "inputs": [{"name": "u1", "streamed": {}}]
  })");
  const std::string data = File("d.csv", "t,u1,x1_minus_x2\n0,1,0\n");
  ASSERT_EQ(Ask({"stream", problem, data, "--session", "rig"}).exit_status, 0);
  const Finished watch = Ask({"watch", "rig", "--once"});
  EXPECT_EQ(watch.exit_status, 0);
  EXPECT_THAT(watch.out, StartsWith("0 samples up to t = 0 s"));
  EXPECT_EQ(
      watch.err,
      "polyest: no sample of sessions/rig counts yet, and these are the numbers of the prior; "
      "rows may wait for later ones\n");
}

TEST_F(SessionsTest, EndTheirWatchWhenTheyAreDeleted) {
  ASSERT_EQ(Stream("rig").exit_status, 0);
  Process watch({POLYEST_PROGRAM, "watch", "rig", "--server", daemon_.address()});
  EXPECT_THAT(watch.ReadLine(), StartsWith("t = "));
  ASSERT_EQ(Ask({"delete", "rig"}).exit_status, 0);
  watch.ReadAll();
  EXPECT_EQ(watch.Wait(), 2);
  EXPECT_THAT(watch.Errors(), AllOf(StartsWith("polyest: "), HasSubstr("rig")));
}

TEST_F(SessionsTest, AnswerTheStudiesAsTheirFilesDo) {
  ASSERT_EQ(Stream("rig").exit_status, 0);
  const std::string problem = Example("oscillator.json");
  const std::string data = File("d.csv", DemoRows(60));
  for (const std::vector<std::string>& study :
       {std::vector<std::string>{"posterior", "--format", "csv"},
        {"profile", "--format", "csv", "--points", "5"},
        {"regularization", "--format", "csv", "--points", "3"},
        {"explain"}}) {
    std::vector<std::string> of_files = study;
    of_files.insert(of_files.end(), {problem, data});
    std::vector<std::string> of_session = study;
    of_session.insert(of_session.end(), {"--session", "rig"});
    const Finished session = Ask(of_session);
    ASSERT_EQ(session.exit_status, 0) << session.err;
    // The session took its rows in two batches, which moves the last digits.
    EXPECT_EQ(Lines(session.out).size(), Lines(Run(of_files).out).size()) << study[0];
    EXPECT_EQ(Lines(session.out)[0].substr(0, 12), Lines(Run(of_files).out)[0].substr(0, 12));
  }
}

TEST_F(SessionsTest, AreExplainedWithTheInputsTheyStreamed) {
  const std::string problem = File("p.json", R"({
    "model": {"builtin": "linear_two_state"},
    "uncertain": [{"name": "theta", "normal": {"mean": 1, "stdDev": 0.2}}],
    "measured": [{"output": "x1_minus_x2", "noise": {"absolute": 0.01}}],
    "inputs": [{"name": "u1", "streamed": {"hold": true}}]
  })");
  std::string rows = "t,x1_minus_x2,u1\n";
  for (int i = 1; i <= 50; ++i) rows += std::to_string(0.04 * i) + ",0,1\n";
  const std::string data = File("u.csv", rows);
  ASSERT_EQ(Ask({"stream", problem, data, "--session", "driven"}).exit_status, 0);
  const Finished session = Ask({"explain", "--session", "driven"});
  EXPECT_EQ(session.exit_status, 0) << session.err;
  EXPECT_EQ(session.out, Run({"explain", problem, data}).out);
}

// The input's cells are empty in every other row.
TEST_F(SessionsTest, AreExplainedWithInputsThatHaveTimesOfTheirOwn) {
  const std::string problem = File("p.json", R"({
    "model": {"builtin": "linear_two_state"},
    "uncertain": [{"name": "theta", "normal": {"mean": 1, "stdDev": 0.2}}],
    "measured": [{"output": "x1_minus_x2", "noise": {"absolute": 100}}],
    "inputs": [{"name": "u1", "streamed": {}}]
  })");
  std::string every = "t,x1_minus_x2,u1\n", some = every;
  for (int i = 1; i <= 60; ++i) {
    const std::string begin = std::to_string(0.04 * i) + ",0,";
    const std::string value = std::to_string(2 - 0.01 * i) + "\n";
    every += begin + value;
    some += begin + (i % 2 == 1 || i == 60 ? value : "\n");
  }
  ASSERT_EQ(Ask({"stream", problem, File("some.csv", some), "--session", "sparse"}).exit_status, 0);
  const Finished session = Ask({"explain", "--session", "sparse"});
  EXPECT_EQ(session.exit_status, 0) << session.err;
  // The input is the same straight line either way. The session has not taken its last rows into
  // account, since further knots could change the input there.
  const std::string remedy = Lines(session.out).back();
  EXPECT_THAT(remedy, HasSubstr("would determine theta to"));
  EXPECT_EQ(remedy, Lines(Run({"explain", problem, File("every.csv", every)}).out).back());
  EXPECT_EQ(remedy, Lines(Run({"explain", problem, File("some.csv", some)}).out).back());
}

TEST_F(SessionsTest, ThatAreNotThereAreNamed) {
  for (const std::vector<std::string>& command : {std::vector<std::string>{"watch", "nowhere"},
                                                  {"posterior", "--session", "nowhere"},
                                                  {"profile", "--session", "nowhere"},
                                                  {"regularization", "--session", "nowhere"},
                                                  {"explain", "--session", "nowhere"}}) {
    const Finished run = Ask(command);
    EXPECT_EQ(run.exit_status, 2) << command[0];
    EXPECT_THAT(run.err, AllOf(StartsWith("polyest: "), HasSubstr("nowhere"))) << command[0];
    EXPECT_EQ(Lines(run.err).size(), 1u);
  }
}

TEST_F(SessionsTest, AreTakenInPlaceOfFilesOnly) {
  const std::string problem = Example("oscillator.json");
  for (const std::vector<std::string>& usage :
       {std::vector<std::string>{"posterior"},
        {"posterior", problem},
        {"posterior", "--session", "rig"},
        {"explain", problem, "d.csv", "--session", "rig", "--server", "a:1"}}) {
    const Finished run = Run(usage);
    EXPECT_EQ(run.exit_status, 2);
    EXPECT_EQ(Lines(run.err).size(), 1u) << run.err;
  }
  EXPECT_THAT(Run({"posterior"}).err, HasSubstr("problem and data, or else --session"));
  EXPECT_THAT(Run({"posterior", problem}).err, HasSubstr("data"));
  EXPECT_THAT(Run({"posterior", "--session", "rig"}).err, HasSubstr("--server"));
}

}  // namespace
}  // namespace polyest::internal
