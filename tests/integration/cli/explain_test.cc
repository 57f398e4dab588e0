// Tests `polyest explain` on the paper's three cases, sections 3.4 to 3.6, whose records are the
// means of the priors' predictions: they have no noise, and their truth is near the priors'
// centres. Remedies are tried on parts of the examples' records.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>

#include <random>

#include "polyest/v1/study_service.pb.h"
#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kOneMass[] = R"({
  "model": {"builtin": "mass_spring_damper"},
  "uncertain": [{"name": "v0", "uniform": {"lower": 0.9, "upper": 1.1}}],
  "measured": [{"output": "x", "noise": {"absolute": 1}}]
})";

class ExplainTest : public CommandTest {
 protected:
  // Returns the explanation of a record of `outputs`, as the problem predicts them. If `as` is
  // given, that problem explains the record, which then has a column of ones too.
  std::string Explain(const std::string& problem, const std::vector<std::string>& outputs,
                      const std::string& as = "", const std::string& ones = "") {
    const std::string file = File("problem.json", problem);
    const Finished predicted =
        Run({"propagate", file, "--until", "2", "--step", "0.02", "--format", "json"});
    EXPECT_EQ(predicted.exit_status, 0) << predicted.err;
    v1::ComputePropagationResponse response;
    EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(predicted.out, &response).ok());
    std::string record = "t";
    for (const std::string& output : outputs) absl::StrAppend(&record, ",", output);
    if (!ones.empty()) absl::StrAppend(&record, ",", ones);
    for (int k = 1; k < response.time_s_size(); ++k) {
      absl::StrAppend(&record, "\n", response.time_s(k));
      for (const auto& output : response.outputs()) {
        absl::StrAppend(&record, ",", output.mean(k));
      }
      if (!ones.empty()) absl::StrAppend(&record, ",1");
    }
    const std::string explained = as.empty() ? file : File("as.json", as);
    const Finished run =
        Run({"explain", explained, File("data.csv", record + "\n"), "--no-remedies"});
    EXPECT_EQ(run.exit_status, 0) << run.err;
    return run.out;
  }
};

TEST_F(ExplainTest, NamesTheRatioThatFreeVibrationTells) {
  EXPECT_THAT(Explain(R"({
    "model": {"builtin": "mass_spring_damper"}, "fixed": {"x0": 1},
    "uncertain": [{"name": "k", "normal": {"mean": 39.5, "stdDev": 2}},
                  {"name": "m", "normal": {"mean": 1, "stdDev": 0.05}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })",
                      {"x"}),
              AllOf(HasSubstr("k is weakly identified"), HasSubstr("k/m is known to "),
                    HasSubstr("No other output of the model would identify m in this experiment")));
}

// Over the whole prior no expansion follows 50 s of oscillation, and one that did not would tell k
// and m apart.
TEST_F(ExplainTest, PromisesNothingThatTheModelDoesNotKeep) {
  const std::string problem = File("problem.json", R"({
    "model": {"builtin": "mass_spring_damper"},
    "fixed": {"x0": 1},
    "uncertain": [{"name": "k", "uniform": {"lower": 31.584, "upper": 47.376}},
                  {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}},
                  {"name": "m", "uniform": {"lower": 0.8, "upper": 1.2}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })");
  const Finished run =
      Run({"explain", problem, POLYEST_SOURCE_DIR "/client/examples/oscillator.csv"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("k/m is known to "), Not(HasSubstr("should identify")),
                    HasSubstr("No other output of the model would identify m in this experiment")));
}

TEST_F(ExplainTest, NamesTheOutputToAdd) {
  EXPECT_THAT(Explain(R"({
    "model": {"builtin": "linear_two_state"},
    "uncertain": [{"name": "theta", "normal": {"mean": 1, "stdDev": 0.2}}],
    "inputs": [{"name": "u1", "step": {"amplitude": 1}}],
    "measured": [{"output": "x1_minus_x2", "noise": {"absolute": 0.01}}]
  })",
                      {"x1_minus_x2"}),
              AllOf(HasSubstr("theta is not identified"), HasSubstr("Measuring x"),
                    HasSubstr(" would determine theta to ±")));
}

TEST_F(ExplainTest, NamesTheOutputToAddWhereTheInputIsStreamed) {
  const std::string before = R"({
    "model": {"builtin": "linear_two_state"},
    "uncertain": [{"name": "theta", "normal": {"mean": 1, "stdDev": 0.2}}],
    "measured": [{"output": "x1_minus_x2", "noise": {"absolute": 0.01}}],
    "inputs": [{"name": "u1", )";
  EXPECT_THAT(Explain(before + R"("step": {"amplitude": 1}}]})", {"x1_minus_x2"},
                      before + R"("streamed": {"hold": true}}],
                                "columns": {"u1": {"from": "step"}}, "useWhen": "u1 > 0"})",
                      "step"),
              AllOf(HasSubstr("theta is not identified"), HasSubstr("Measuring x"),
                    HasSubstr(" would determine theta to ±")));
}

// The input is 0 in the first run, where it has no sample.
TEST_F(ExplainTest, ProposesWhereAnInputHasNoSamplesInTheFirstRun) {
  const std::string problem = File("problem.json", R"({
    "model": {"builtin": "mass_spring_damper"}, "fixed": {"x0": 1},
    "uncertain": [{"name": "k", "normal": {"mean": 39.5, "stdDev": 2}},
                  {"name": "m", "normal": {"mean": 1, "stdDev": 0.05}}],
    "inputs": [{"name": "force", "streamed": {}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.5}}]
  })");
  const std::string data = File("data.csv",
                                "t,run,x,force\n0.1,0,0.8,\n0.2,0,0.3,\n0.3,0,-0.3,\n"
                                "0.1,1,0.8,0\n0.2,1,0.3,0\n0.3,1,-0.3,0\n");
  ASSERT_EQ(Run({"estimate", problem, data}).exit_status, 0);
  const Finished run = Run({"explain", problem, data, "--no-remedies"});
  EXPECT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("m is not identified: "),
                             HasSubstr("the data add almost nothing to your prior, 1.000 ± 0.050"),
                             HasSubstr("No other output of the model would identify m")));
}

TEST_F(ExplainTest, SpeaksOfTheParametersOfEachRun) {
  const std::string problem = File("problem.json", R"({
    "model": {"builtin": "mass_spring_damper"},
    "uncertain": [{"name": "v0", "uniform": {"lower": 0.9, "upper": 1.1}, "perRun": true}],
    "measured": [{"output": "x", "noise": {"absolute": 1}}]
  })");
  const Finished run =
      Run({"explain", problem, File("data.csv", "t,run,x\n0.5,0,0.1\n0.5,1,0.1\n")});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("v0[0] is not identified"), HasSubstr("v0[1] is not identified"),
                    HasSubstr("would determine v0[0] to ±")));
}

TEST_F(ExplainTest, ProposesNothingForARecordWithoutDuration) {
  const std::string problem = File("problem.json", kOneMass);
  const Finished run = Run({"explain", problem, File("data.csv", "t,x\n0,0.1\n")});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("v0 is not identified"), Not(HasSubstr("would ")),
                             Not(HasSubstr("experiment"))));
}

TEST_F(ExplainTest, ProposesForTheLongestRunWhereTheLastHasJustBegun) {
  const std::string problem = File("problem.json", kOneMass);
  const Finished run = Run({"explain", problem, File("data.csv", "t,run,x\n0.5,0,0.1\n0,1,0.1\n")});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("v0 is not identified"), HasSubstr("would determine v0 to ±")));
}

TEST_F(ExplainTest, NamesTheExcitationToChange) {
  EXPECT_THAT(Explain(R"({
    "model": {"builtin": "roll_plane_2dof"},
    "uncertain": [{"name": "M", "beta": {"alpha": 2, "beta": 2, "lower": 500, "upper": 700}},
                  {"name": "I", "beta": {"alpha": 2, "beta": 2, "lower": 55, "upper": 80}}],
    "inputs": [
      {"name": "u1", "halfSineBump": {"amplitude": 0.05, "startS": 0.1, "durationS": 0.2}},
      {"name": "u2", "halfSineBump": {"amplitude": 0.05, "startS": 0.1, "durationS": 0.2}}],
    "measured": [{"output": "x1", "noise": {"absolute": 0.002}},
                 {"output": "x2", "noise": {"absolute": 0.002}}]
  })",
                      {"x1", "x2"}),
              AllOf(HasSubstr("M is "), HasSubstr("I is not identified"),
                    HasSubstr("Another excitation, only u"), HasSubstr(" would determine I to ±")));
}

// The data tell a² and not its sign.
TEST_F(ExplainTest, SaysThatSeveralValuesFit) {
  const std::string problem = File("problem.json", R"({
    "model": {"equations": {"outputs": {"y": "a^2"}}},
    "uncertain": [{"name": "a", "uniform": {"lower": -1.5, "upper": 1}}],
    "measured": [{"output": "y", "noise": {"absolute": 0.01}}]
  })");
  const std::string data = File("data.csv", "t,y\n0,0.64\n1,0.65\n2,0.63\n");
  const Finished run = Run({"explain", problem, data, "--no-remedies"});
  EXPECT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("a is weakly identified: several separate values fit the data. About "
                              "the most probable one it is "),
                    HasSubstr("0.8000 ± 0.0036, over all of them "),
                    HasSubstr("the cost has other minima of comparable depth at a = "),
                    Not(HasSubstr("should identify"))));
  const Finished estimate = Run({"estimate", problem, data});
  EXPECT_THAT(estimate.out, AllOf(HasSubstr(" ± 0.80 "), HasSubstr("  weak\n")));
}

TEST_F(ExplainTest, HasNothingToAddWhereAllIsIdentified) {
  const Finished run = Run({"explain", Example("oscillator.json"), Example("oscillator.csv")});
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_THAT(run.out, AllOf(HasSubstr("k is identified: 41."), HasSubstr("c is identified: 0.2"),
                             Not(HasSubstr("excitation"))));
}

// Returns an oscillator's problem. `unknown` is the uncertain parameter, `fixed` the known values.
std::string PerfectOscillator(const std::string& fixed, const std::string& unknown,
                              const std::string& more = "") {
  return absl::StrCat(
      R"({"model": {"builtin": "mass_spring_damper"}, "fixed": )", fixed, R"(, "uncertain": [)",
      unknown, R"(], "measured": [{"output": "x", "noise": {"absolute": 0.005}}])", more, "}");
}

constexpr char kReleased[] = R"({"m": 1, "x0": 1, "c": 0.23})";
constexpr char kStiffness[] = R"({"name": "k", "normal": {"mean": 41, "stdDev": 1}})";

class RemediesTest : public CommandTest {
 protected:
  // Returns the header and every `step`-th of the first `rows` rows of an example's record.
  std::string Record(const std::string& name, int rows, int step = 1) {
    std::ifstream in(Example(name));
    std::string text, line;
    for (int i = 0; i <= rows && std::getline(in, line); ++i) {
      if (i % step == 0) text += line + "\n";
    }
    return File("record.csv", text);
  }

  std::string Explain(const std::string& problem, const std::string& record,
                      const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments = {"explain", File("problem.json", problem), record};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Finished run = Run(arguments);
    EXPECT_EQ(run.exit_status, 0) << run.err;
    return run.out;
  }
};

TEST_F(RemediesTest, ProcessNoiseIsPreferredWhereAForceDisturbs) {
  EXPECT_THAT(Explain(PerfectOscillator(kReleased, kStiffness), Record("disturbed.csv", 120)),
              AllOf(HasSubstr("The evidence prefers process noise on v, by "),
                    HasSubstr("the held-out rows agree"),
                    HasSubstr(R"("processNoise": [{"state":"v","unknown":true)")));
}

TEST_F(RemediesTest, DriftIsPreferredWhereADamperWarmsUp) {
  const std::string problem = PerfectOscillator(
      R"({"m": 1, "k": 41.2})", R"({"name": "c", "lognormal": {"mean": 1, "stdDev": 0.4}})",
      R"(, "inputs": [{"name": "force", "sinusoid": {"amplitude": 2, "frequencyHz": 1}}])");
  EXPECT_THAT(Explain(problem, Record("warming.csv", 1200, 8)),
              AllOf(HasSubstr("The evidence prefers drift of c, by "),
                    HasSubstr(R"("drift":{"randomWalk":{"unknown":true)")));
}

TEST_F(RemediesTest, CorrelatedNoiseIsPreferredWhereTheSensorWanders) {
  std::ifstream in(Example("oscillator.csv"));
  std::string line, record;
  std::getline(in, line);
  record = line + "\n";
  std::mt19937 random(1);
  double error = 0;  // first-order autoregressive
  for (int i = 0; i < 120 && std::getline(in, line); ++i) {
    const size_t comma = line.find(',');
    error = 0.9 * error + 0.04 * (static_cast<double>(random()) / std::mt19937::max() - 0.5);
    absl::StrAppend(&record, line.substr(0, comma), ",", std::stod(line.substr(comma + 1)) + error,
                    "\n");
  }
  EXPECT_THAT(Explain(PerfectOscillator(kReleased, kStiffness), File("record.csv", record)),
              AllOf(HasSubstr("The evidence prefers correlated noise of x, by "),
                    HasSubstr("Correlated noise also takes up what a model lacks"),
                    HasSubstr(R"("correlation":{"auto":true})")));
}

// The sensor's gain and the initial displacement do the same in free vibration.
TEST_F(RemediesTest, ComeAfterAFixedValueThatIsWrong) {
  std::ifstream in(Example("oscillator.csv"));
  std::string line, record;
  std::getline(in, line);
  record = line + "\n";
  for (int i = 0; i < 120 && std::getline(in, line); ++i) {
    const size_t comma = line.find(',');
    absl::StrAppend(&record, line.substr(0, comma), ",", 1.05 * std::stod(line.substr(comma + 1)),
                    "\n");
  }
  EXPECT_THAT(
      Explain(PerfectOscillator(kReleased, kStiffness), File("record.csv", record)),
      AllOf(HasSubstr("fixed value in conflict: the residuals ask for x"),
            HasSubstr(" instead of 1 "), HasSubstr("Before any remedy below, correct what")));
}

TEST_F(RemediesTest, NoEvidenceIsNeededForARemedyThatLeavesNoContradiction) {
  const std::string white = R"({
    "model": {"builtin": "mass_spring_damper"}, "fixed": {"m": 1, "x0": 1},
    "uncertain": [{"name": "k", "uniform": {"lower": 31.584, "upper": 47.376}},
                  {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}}],
    "measured": [{"output": "x", "noise": {"unknown": true, "outliers": "STUDENT_T"}}]})";
  EXPECT_THAT(Explain(white, Example("rough_sensor.csv")),
              AllOf(HasSubstr("With correlated noise of x nothing contradicts the problem"),
                    HasSubstr(R"("correlation":{"auto":true})"),
                    HasSubstr("Refused: process noise on v, drift of k"),
                    Not(HasSubstr("prefers process noise"))));
}

TEST_F(RemediesTest, NothingIsTriedWithoutAContradictionOrIfItIsNotWanted) {
  const Finished good = Run({"explain", Example("oscillator.json"), Example("oscillator.csv")});
  EXPECT_THAT(good.out, Not(HasSubstr("remed")));
  EXPECT_THAT(Explain(PerfectOscillator(kReleased, kStiffness), Record("disturbed.csv", 120),
                      {"--no-remedies"}),
              AllOf(HasSubstr("model misfit"), Not(HasSubstr("log evidence gained"))));
}

TEST_F(RemediesTest, NothingIsTriedWithoutEvidence) {
  EXPECT_THAT(Explain(PerfectOscillator(kReleased, kStiffness, R"(, "regularization": 2)"),
                      Record("disturbed.csv", 120)),
              HasSubstr("No remedy was tried: the problem has no evidence"));
}

TEST_F(RemediesTest, OfASessionAreThoseOfItsFiles) {
  const DaemonProcess daemon;
  const std::string problem = File("problem.json", PerfectOscillator(kReleased, kStiffness));
  const std::string data = Record("disturbed.csv", 120);
  const Finished streamed =
      Run({"stream", problem, data, "--server", daemon.address(), "--session", "rig"});
  ASSERT_EQ(streamed.exit_status, 0) << streamed.err;
  const Finished run = Run({"explain", "--session", "rig", "--server", daemon.address()});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("log evidence gained"));
  EXPECT_EQ(run.out, Run({"explain", problem, data}).out);
}

}  // namespace
}  // namespace polyest::internal
