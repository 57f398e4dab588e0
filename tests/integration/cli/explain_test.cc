// Tests `polyest explain` on the paper's three cases, sections 3.4 to 3.6. The records are the
// means of the priors' predictions: they have no noise, and their truth is near the priors'
// centres.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>

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
    const Finished run = Run({"explain", explained, File("data.csv", record + "\n")});
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
                      before + R"("streamed": {"hold": true}}]})", "u1"),
              AllOf(HasSubstr("theta is not identified"), HasSubstr("Measuring x"),
                    HasSubstr(" would determine theta to ±")));
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

TEST_F(ExplainTest, HasNothingToAddWhereAllIsIdentified) {
  const Finished run = Run({"explain", Example("oscillator.json"), Example("oscillator.csv")});
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_THAT(run.out, AllOf(HasSubstr("k is identified: 41."), HasSubstr("c is identified: 0.2"),
                             Not(HasSubstr("excitation"))));
}

}  // namespace
}  // namespace polyest::internal
