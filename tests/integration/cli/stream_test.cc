// Tests `polyest stream` against a daemon.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>

#include <memory>

#include "core/common/sanitizer.h"
#include "polyest/client.h"
#include "polyest/problem_file.h"
#include "tests/integration/cli/ballast.h"
#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Where a daemon listens that another one follows at its port. At 127.0.0.1 another program, or an
// attempt to connect, might take the port while no daemon has it.
constexpr char kRestartable[] = "127.0.0.2:0";

class StreamTest : public CommandTest {
 protected:
  std::vector<std::string> Command(const std::string& data,
                                   const std::vector<std::string>& options) const {
    std::vector<std::string> arguments = {"stream", Example("oscillator.json"), data, "--server",
                                          daemon_.address()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return arguments;
  }

  // Returns the estimate of `polyest estimate` from the first rows of the demonstration record.
  v1::Estimate EstimateOf(int rows) const {
    const Finished run = Run({"estimate", Example("oscillator.json"),
                              File("whole.csv", DemoRows(rows)), "--format", "json"});
    EXPECT_EQ(run.exit_status, 0) << run.err;
    return ParseEstimate(run.out);
  }

  // Returns the last line, which must be an estimate, without its sequence number and without the
  // cost of the intermediate checks.
  static v1::Estimate LastEstimate(const std::string& lines) {
    v1::Estimate estimate = ParseEstimate(Lines(lines).back());
    estimate.clear_sequence();
    return estimate;
  }

  static void ExpectSame(v1::Estimate a, v1::Estimate b) {
    a.mutable_expansion()->clear_trajectories();
    b.mutable_expansion()->clear_trajectories();
    EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(a, b))
        << a.DebugString() << b.DebugString();
  }

  DaemonProcess daemon_;
};

TEST_F(StreamTest, EndsWithTheEstimateOfTheWholeRecord) {
  const Finished run = Run(Command(File("d.csv", DemoRows(100)), {"--format", "jsonl"}));
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const auto lines = Lines(run.out);
  ASSERT_GE(lines.size(), 2u);
  int64_t sequence = 0;
  for (const std::string& line : lines) {
    const v1::Estimate estimate = ParseEstimate(line);
    EXPECT_GE(estimate.sequence(), sequence);
    sequence = estimate.sequence();
  }
  EXPECT_EQ(sequence, 4);  // 100 rows, 30 a batch
  ExpectSame(LastEstimate(run.out), EstimateOf(100));
}

TEST_F(StreamTest, DoesNotDependOnHowRowsAreCutIntoBatches) {
  const std::string data = File("d.csv", DemoRows(60));
  const Finished small = Run(Command(data, {"--format", "jsonl", "--batch", "7"}));
  const Finished large = Run(Command(data, {"--format", "jsonl", "--batch", "1000"}));
  ASSERT_EQ(small.exit_status, 0) << small.err;
  ASSERT_EQ(large.exit_status, 0) << large.err;
  ExpectSame(LastEstimate(small.out), LastEstimate(large.out));
}

// Checks that the last rows arrive although their input curve depends on there being no more rows.
TEST_F(StreamTest, TakesTheLastRowsOfASmoothInputToo) {
#if POLYEST_THREAD_SANITIZER
  GTEST_SKIP() << "a quarter of an hour of numerics, whose threads are those of other tests";
#endif
  const std::string data = Example("damper_rig.csv");
  const Finished streamed = Run({"stream", Example("damper_rig.json"), data, "--server",
                                 daemon_.address(), "--batch", "300", "--format", "jsonl"});
  ASSERT_EQ(streamed.exit_status, 0) << streamed.err;
  const Finished whole = Run({"estimate", Example("damper_rig.json"), data, "--format", "json"});
  ASSERT_EQ(whole.exit_status, 0) << whole.err;
  const v1::Estimate last = LastEstimate(streamed.out);
  EXPECT_EQ(last.samples(), 1602);
  ExpectSame(last, ParseEstimate(whole.out));
}

TEST_F(StreamTest, ReadsStandardInputAndPrintsATableAtTheEnd) {
  const Finished run = Run(Command("-", {"--rate", "1000"}), DemoRows(60));
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out, StartsWith("t = "));
  EXPECT_THAT(run.out, AllOf(HasSubstr("  k = "), HasSubstr("\n60 samples up to t = 3 s\n")));
}

// A program that is killed within "3.05,-0.8" leaves a displacement of 0 or so.
TEST_F(StreamTest, TakesNoMeasurementFromALineThatThePipeCutsOff) {
  const Finished run = Run(Command("-", {"--format", "jsonl"}), DemoRows(60) + "3.05,-0");
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_EQ(run.err, "polyest: standard input:62: the last line has no end and is left out\n");
  ExpectSame(LastEstimate(run.out), EstimateOf(60));
  std::string file = DemoRows(60);
  file.pop_back();
  const std::string data = File("d.csv", file);
  const Finished whole = Run(Command(data, {"--format", "jsonl"}));
  EXPECT_EQ(whole.err, "polyest: " + data +
                           ":61: the last line has no end; its last value may be "
                           "cut off\n");
  ExpectSame(LastEstimate(whole.out), EstimateOf(60));
}

TEST_F(StreamTest, ResumesASessionWhereItEnded) {
  const Finished first =
      Run(Command(File("d.csv", DemoRows(45)), {"--format", "jsonl", "--session", "rig-1"}));
  ASSERT_EQ(first.exit_status, 0) << first.err;
  const Finished second =
      Run(Command(File("d.csv", DemoRows(100)), {"--format", "jsonl", "--session", "rig-1"}));
  ASSERT_EQ(second.exit_status, 0) << second.err;
  EXPECT_EQ(
      second.err,
      "polyest: resumed sessions/rig-1; 45 rows are not later than t = 2.25 s of run 0, up to "
      "which the session has its data, and were skipped; rows of another record need a column "
      "run with the next number, 1\n");
  ExpectSame(LastEstimate(second.out), EstimateOf(100));
}

TEST_F(StreamTest, SaysThatItResumesASessionBeforeTheDataEnd) {
  ASSERT_EQ(Run(Command(File("d.csv", DemoRows(45)), {"--session", "rig-1"})).exit_status, 0);
  std::vector<std::string> arguments = Command("-", {"--session", "rig-1"});
  arguments.insert(arguments.begin(), POLYEST_PROGRAM);
  Process process(arguments);
  process.Write(DemoRows(60));
  // The command's input stays open meanwhile.
  Client client(daemon_.address());
  while (process.Errors().find("resumed sessions/rig-1") == std::string::npos) {
    ASSERT_TRUE(client.GetStatus({}).ok());
  }
  process.CloseInput();
  process.ReadAll();
  EXPECT_EQ(process.Wait(), 0) << process.Errors();
  EXPECT_EQ(
      process.Errors(),
      "polyest: resumed sessions/rig-1; 45 rows are not later than t = 2.25 s of run 0, up to "
      "which the session has its data, and were skipped; rows of another record need a column "
      "run with the next number, 1\n");
}

TEST_F(StreamTest, SaysThatNoRowIsLaterThanThoseOfTheSession) {
  const std::string data = File("d.csv", DemoRows(45));
  ASSERT_EQ(Run(Command(data, {"--session", "rig-1"})).exit_status, 0);
  EXPECT_THAT(Run(Command(data, {"--session", "rig-1"})).err,
              HasSubstr("; 45 rows are not later than t = 2.25 s of run 0, up to which"));
}

TEST_F(StreamTest, TakesAnotherRecordAsTheNextRun) {
  ASSERT_EQ(Run(Command(File("d.csv", DemoRows(45)), {"--session", "rig-1"})).exit_status, 0);
  const std::string second = File("second.csv", "t,run,x\n0,1,1\n0.05,1,0.9\n");
  const Finished run = Run(Command(second, {"--session", "rig-1", "--format", "jsonl"}));
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_EQ(run.err, "polyest: resumed sessions/rig-1 after t = 2.25 s of run 0\n");
  EXPECT_EQ(LastEstimate(run.out).samples(), 47);
  const Finished fresh = Run(Command(second, {"--session", "rig-2"}));
  EXPECT_EQ(fresh.exit_status, 2);
  EXPECT_THAT(fresh.err, HasSubstr("runs start at 0 and never decrease"));
}

// Exchanges each row with its neighbour, which is 0.05 s from it.
std::string WithNeighboursExchanged(const std::string& rows) {
  std::istringstream in(rows);
  std::string header, first, second;
  std::getline(in, header);
  std::string text = header + "\n";
  while (std::getline(in, first) && std::getline(in, second)) text += second + "\n" + first + "\n";
  return text;
}

TEST_F(StreamTest, PutsRowsInOrderWithinAWindow) {
  const std::string data = File("d.csv", WithNeighboursExchanged(DemoRows(100)));
  const Finished run = Run(Command(
      data, {"--format", "jsonl", "--batch", "7", "--reorder-window", "0.1", "--session", "rig"}));
  ASSERT_EQ(run.exit_status, 0) << run.err;
  ExpectSame(LastEstimate(run.out), EstimateOf(100));
  const Finished none = Run(Command(data, {}));
  EXPECT_EQ(none.exit_status, 2);
  EXPECT_THAT(none.err, HasSubstr("column t: 0.05 must be later than 0.1 of the row before"));
  const Finished narrow = Run(Command(data, {"--reorder-window", "0.01"}));
  EXPECT_EQ(narrow.exit_status, 2);
  EXPECT_THAT(narrow.err, HasSubstr("comes too late"));
  EXPECT_THAT(Run(Command(data, {"--session", "rig", "--reorder-window", "0.1"})).err,
              HasSubstr("session rig already has rows"));
  const std::string ordered = File("ordered.csv", DemoRows(100));
  EXPECT_THAT(Run(Command(ordered, {"--session", "rig"})).err,
              HasSubstr("already exists with a reorderWindowS of 0.1 s, not 0 s"));
}

TEST_F(StreamTest, DoesNotMixProblemsInASession) {
  const std::string data = File("d.csv", DemoRows(30));
  ASSERT_EQ(Run(Command(data, {"--session", "rig-1"})).exit_status, 0);
  const std::string other = File("other.json", R"({
    "model": {"builtin": "mass_spring_damper"},
    "uncertain": [{"name": "k", "uniform": {"lower": 30, "upper": 50}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })");
  const Finished run =
      Run({"stream", other, data, "--server", daemon_.address(), "--session", "rig-1"});
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(run.err, HasSubstr("session rig-1 already exists with a different problem"));
}

TEST_F(StreamTest, ResumesWithAProblemFileThatNamesItsSchema) {
  const std::string problem = File("problem.json", R"({"$schema": "https://example.org/p.json",
    "model": {"builtin": "mass_spring_damper"}, "fixed": {"m": 1, "x0": 1},
    "uncertain": [{"name": "k", "uniform": {"lower": 30, "upper": 50}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })");
  for (const int rows : {30, 60}) {
    const Finished run = Run({"stream", problem, File("d.csv", DemoRows(rows)), "--server",
                              daemon_.address(), "--session", "rig-1"});
    EXPECT_EQ(run.exit_status, 0) << run.err;
  }
}

TEST_F(StreamTest, KeepsTheRowsBeforeABadOneAndSaysWhichItIs) {
  const Finished run = Run(Command("-", {"--session", "rig-1", "--format", "jsonl"}),
                           DemoRows(35) + "1,2,3\n" + "1.8,0\n");
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(run.err, HasSubstr("standard input:37: the row has 3 cells, the header has 2"));
  EXPECT_THAT(run.err, HasSubstr("; sessions/rig-1 has kept the 35 rows sent before\n"));
  EXPECT_EQ(LastEstimate(run.out).samples(), 35);
  // The corrected record goes on there.
  const Finished second =
      Run(Command("-", {"--session", "rig-1", "--format", "jsonl"}), DemoRows(60));
  ASSERT_EQ(second.exit_status, 0) << second.err;
  EXPECT_THAT(second.err, HasSubstr("; 35 rows are not later than"));
  ExpectSame(LastEstimate(second.out), EstimateOf(60));
}

TEST_F(StreamTest, KeepsTheRowsBeforeOneThatTheDaemonRefusesAndSaysWhichItIs) {
  const std::string good = DemoRows(60);
  const std::string bad = DemoRows(52) + "2.65,1e90\n2.7,0\n";
  const std::vector<std::string> options = {"--session", "rig-1",    "--batch",
                                            "20",        "--format", "jsonl"};
  const Finished run = Run(Command(File("bad.csv", bad), options));
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(run.err, HasSubstr("bad.csv:54: column x: 1e+90 is more than"));
  EXPECT_THAT(run.err, HasSubstr("; sessions/rig-1 has kept the 52 rows sent before\n"));
  EXPECT_EQ(LastEstimate(run.out).samples(), 52);
  // The rows that the session has already count as rows of the file, too.
  const Finished again = Run(Command(File("bad.csv", bad), options));
  EXPECT_EQ(again.exit_status, 2);
  EXPECT_THAT(again.err, HasSubstr("bad.csv:54: column x: 1e+90 is more than"));
  const Finished second = Run(Command(File("good.csv", good), options));
  ASSERT_EQ(second.exit_status, 0) << second.err;
  ExpectSame(LastEstimate(second.out), EstimateOf(60));
}

TEST_F(StreamTest, GoesOnWhereItStoodWhenTheDaemonWasKilledAndStartedAgain) {
  const TestFolder data;
  auto daemon = std::make_unique<DaemonProcess>(std::vector<std::string>{"--data-dir", data.path()},
                                                kRestartable);
  const std::string address = daemon->address();
  std::vector<std::string> arguments = {POLYEST_PROGRAM,
                                        "stream",
                                        Example("oscillator.json"),
                                        "-",
                                        "--server",
                                        address,
                                        "--batch",
                                        "30",
                                        "--format",
                                        "jsonl"};
  Process process(arguments);
  process.Write(DemoRows(30));
  EXPECT_THAT(process.ReadLine(), HasSubstr("\"sequence\":\"1\""));
  daemon->Kill();
  daemon =
      std::make_unique<DaemonProcess>(std::vector<std::string>{"--data-dir", data.path()}, address);
  const std::string all = DemoRows(90);
  process.Write(all.substr(DemoRows(30).size()));
  process.CloseInput();
  std::string last;
  for (std::string line = process.ReadLine(); !line.empty(); line = process.ReadLine()) last = line;
  EXPECT_EQ(process.Wait(), 0) << process.Errors();
  EXPECT_THAT(process.Errors(), AllOf(HasSubstr("connection lost"), HasSubstr("connected again")));
  const Finished undisturbed =
      Run(Command("-", {"--batch", "30", "--format", "jsonl"}), DemoRows(90));
  EXPECT_EQ(last, Lines(undisturbed.out).back());
}

TEST_F(StreamTest, HoldsOutWhileTheDiskIsFullAndGoesOnWhenThereIsRoom) {
  DaemonProcess daemon({"--max-disk-mb", "1"});
  Client client(daemon.address());
  const auto problem = ReadProblemFile(Example("oscillator.json"));
  ASSERT_TRUE(problem.ok()) << problem.status();
  std::unique_ptr<Process> process;
  const auto is_full = [&process] {
    return process->Errors().find("cannot accept batches now") != std::string::npos;
  };
  const std::string first = DemoRows(30);
  // While the daemon tidies up it may find room for the stream after all; then another one begins.
  for (int attempt = 0; attempt < 20 && (!process || !is_full()); ++attempt) {
    process = std::make_unique<Process>(std::vector<std::string>{
        POLYEST_PROGRAM, "stream", Example("oscillator.json"), "-", "--server", daemon.address(),
        "--batch", "30", "--format", "jsonl"});
    process->Write(first);
    ASSERT_THAT(process->ReadLine(), HasSubstr("\"sequence\":\"1\""));
    if (attempt > 0) {
      ASSERT_EQ(Run({"delete", "ballast", "--server", daemon.address()}).exit_status, 0);
    }
    Ballast ballast(client, *problem);
    ASSERT_NO_FATAL_FAILURE(ballast.Fill());
    process->Write(DemoRows(90).substr(first.size()));
    process->CloseInput();
    // Asks the daemon meanwhile instead of sleeping.
    while (!is_full() && !process->HasEnded()) ASSERT_TRUE(client.GetStatus({}).ok());
  }
  ASSERT_TRUE(is_full());
  ASSERT_EQ(Run({"delete", "ballast", "--server", daemon.address()}).exit_status, 0);
  const std::vector<std::string> estimates = Lines(process->ReadAll());
  EXPECT_EQ(process->Wait(), 0) << process->Errors();
  EXPECT_THAT(process->Errors(), HasSubstr("the daemon accepts batches again"));
  const Finished undisturbed =
      Run(Command("-", {"--batch", "30", "--format", "jsonl"}), DemoRows(90));
  EXPECT_EQ(estimates.back(), Lines(undisturbed.out).back());
}

TEST_F(StreamTest, GivesUpAtALimitThatWaitingDoesNotCure) {
  DaemonProcess daemon({"--max-session-rows", "45"});
  const Finished run = Run({"stream", Example("oscillator.json"), "-", "--server", daemon.address(),
                            "--batch", "30", "--format", "jsonl"},
                           DemoRows(90));
  EXPECT_EQ(run.exit_status, 3);
  EXPECT_THAT(Lines(run.err), testing::SizeIs(1));
  EXPECT_THAT(run.err, HasSubstr("(--max-session-rows)"));
  EXPECT_THAT(run.err, HasSubstr(" has kept the 30 rows sent before\n"));
}

TEST_F(StreamTest, SaysThatARestartedDaemonHasLostTheSession) {
  DaemonProcess daemon({}, kRestartable);
  Process process(
      {POLYEST_PROGRAM, "stream", Example("oscillator.json"), "-", "--server", daemon.address()});
  process.Write(DemoRows(30));
  EXPECT_THAT(process.ReadLine(), StartsWith("t = 1.5 s"));
  daemon.Kill();
  DaemonProcess restarted({}, daemon.address());
  process.CloseInput();
  process.ReadAll();
  EXPECT_EQ(process.Wait(), 3);
  EXPECT_THAT(process.Errors(),
              AllOf(HasSubstr("connection lost"), HasSubstr("has lost sessions/")));
}

}  // namespace
}  // namespace polyest::internal
