// Tests the command's answers, computed in this process and by a daemon.

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "polyest/v1/study_service.pb.h"
#include "tests/integration/cli/same_answer.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

class AnswersTest : public SameAnswerTest {};

TEST_F(AnswersTest, EstimatesAgreeToTheLastDigit) {
  const std::string data = File("data.csv", DemoRows(200));
  ExpectSameAnswer({"estimate", Example("oscillator.json"), data, "--format", "json"});
  ExpectSameAnswer({"estimate", Example("oscillator.json"), data});
}

TEST_F(AnswersTest, PropagationsAgreeToTheLastDigit) {
  const std::vector<std::string> command = {
      "propagate", Example("forced.json"), "--until", "2", "--step", "0.5"};
  for (const char* const format : {"table", "json", "csv"}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"--format", format});
    ExpectSameAnswer(arguments);
  }
}

TEST_F(AnswersTest, CostsAgreeToTheLastDigit) {
  const std::string data = File("data.csv", DemoRows(20));
  ExpectSameAnswer({"cost", Example("oscillator.json"), data, "--grid", "5"});
  ExpectSameAnswer({"cost", Example("oscillator.json"), data, "--grid", "5", "--format", "csv"});
}

TEST_F(AnswersTest, PredictionsAgreeToTheLastDigit) {
  const std::string data = File("data.csv", DemoRows(100)), other = File("b.csv", DemoRows(40));
  ExpectSameAnswer({"fit", Example("oscillator.json"), data, "--format", "csv"});
  ExpectSameAnswer({"fit", Example("oscillator.json"), data, "--validate", other});
}

TEST_F(AnswersTest, PosteriorsAgreeToTheLastDigit) {
  const std::string data = File("data.csv", DemoRows(100));
  const std::vector<std::string> command = {
      "posterior", Example("oscillator.json"), data, "--samples", "5", "--joint", "k,c"};
  for (const char* const format : {"table", "json", "csv"}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"--format", format});
    ExpectSameAnswer(arguments);
  }
}

TEST_F(AnswersTest, SensitivitiesAgreeToTheLastDigit) {
  const std::vector<std::string> command = {
      "sensitivity", Example("oscillator.json"), "--until", "2", "--outputs", "x,v"};
  for (const char* const format : {"table", "json", "csv"}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"--format", format});
    ExpectSameAnswer(arguments);
  }
}

TEST_F(AnswersTest, DesignsAgreeToTheLastDigit) {
  const std::string data = File("data.csv", DemoRows(40));
  ExpectSameAnswer({"design", Example("oscillator.json"), "--until", "2"});
  ExpectSameAnswer({"design", Example("oscillator.json"), data, "--until", "2", "--outputs", "v",
                    "--samples", "3", "--format", "json"});
}

TEST_F(AnswersTest, ProfilesAgreeToTheLastDigit) {
  const std::string data = File("data.csv", DemoRows(100));
  for (const char* const format : {"table", "json", "csv"}) {
    ExpectSameAnswer({"profile", Example("oscillator.json"), data, "--format", format});
  }
}

TEST_F(AnswersTest, RegularizationsAgreeToTheLastDigit) {
  const std::string data = File("data.csv", DemoRows(100));
  for (const char* const format : {"table", "json", "csv"}) {
    ExpectSameAnswer(
        {"regularization", Example("oscillator.json"), data, "--points", "9", "--format", format});
  }
}

TEST_F(AnswersTest, ModelsAgree) {
  ExpectSameAnswer({"models"});
  ExpectSameAnswer({"models", "--format", "json"});
  ExpectSameAnswer({"models", "duffing"});
  ExpectSameAnswer({"models", "duffing", "--format", "json"});
  ExpectSameAnswer({"models", "bicycle", "--format", "json"});  // its mu is infinite
}

TEST_F(CommandTest, PrintsATableThatAPersonCanRead) {
  const std::string data = File("data.csv", DemoRows(100));
  const Finished run = Run({"estimate", Example("oscillator.json"), data});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out, StartsWith("100 samples up to t = 5 s\n"));
  EXPECT_THAT(run.out, HasSubstr("identified"));
  EXPECT_THAT(run.out, HasSubstr("N/m"));
}

TEST_F(CommandTest, PrintsOneCsvRowATimeOfAPropagation) {
  const Finished run = Run(
      {"propagate", Example("forced.json"), "--until", "1", "--step", "0.25", "--format", "csv"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const auto lines = Lines(run.out);
  ASSERT_THAT(lines, SizeIs(6));
  EXPECT_EQ(lines[0], "t,x.mean,x.stdDev,x.q0.025,x.q0.5,x.q0.975,x.residual");
  EXPECT_THAT(lines[5], StartsWith("1,"));
}

TEST_F(CommandTest, RanksTheParametersThatMatter) {
  const Finished run =
      Run({"sensitivity", Example("oscillator.json"), "--until", "4", "--format", "json"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  v1::ComputeSensitivityResponse response;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(run.out, &response).ok()) << run.out;
  ASSERT_EQ(response.activity_size(), 2);
  // The README says so.
  EXPECT_EQ(response.activity(0).parameter(), "k");
  EXPECT_NEAR(response.activity(0).share(), 0.99, 0.01);
  EXPECT_EQ(response.activity(1).parameter(), "c");
  EXPECT_NEAR(response.activity(1).peak_to_noise(), 7, 0.5);
  EXPECT_EQ(response.time_s_size(), 101);
  EXPECT_EQ(response.draw_count(), 512);
  EXPECT_EQ(response.diagnostics_size(), 0);
}

TEST_F(CommandTest, SaysAtHowManyDrawsASensitivityIsComparedWithTheModel) {
  const Finished run =
      Run({"sensitivity", Example("oscillator.json"), "--until", "1", "--draws", "16"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("compared with the model at 16 draws of the prior\n"));
}

TEST_F(CommandTest, PrintsOneCsvRowATimeOfTheSensitivities) {
  const Finished run = Run(
      {"sensitivity", Example("forced.json"), "--until", "1", "--step", "0.25", "--format", "csv"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const auto lines = Lines(run.out);
  ASSERT_THAT(lines, SizeIs(6));
  EXPECT_EQ(lines[0],
            "t,x.mean,x.stdDev,x.residual,x.noise,x.first.c,x.total.c,x.first.force.amplitude,"
            "x.total.force.amplitude");
  EXPECT_THAT(lines[5], StartsWith("1,"));
}

v1::ComputeExperimentDesignResponse DesignOf(const Finished& run) {
  EXPECT_EQ(run.exit_status, 0) << run.err;
  v1::ComputeExperimentDesignResponse response;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(run.out, &response).ok()) << run.out;
  return response;
}

// Compares the inputs of forced.json at a tenth of their frequency and at their own frequency.
TEST_F(CommandTest, RanksTheInputsOfANextExperiment) {
  const std::string slow = File("slow.json", R"({
    "model": {"builtin": "mass_spring_damper"},
    "inputs": [{"name": "force", "sinusoid": {"amplitude": 1, "frequencyHz": 0.08}}]
  })");
  const Finished run = Run({"design", Example("forced.json"), "--until", "10", "--candidate", slow,
                            "--samples", "4", "--format", "json"});
  const v1::ComputeExperimentDesignResponse response = DesignOf(run);
  ASSERT_EQ(response.candidates_size(), 2);
  EXPECT_EQ(response.candidates(0).name(), Example("forced.json"));
  EXPECT_EQ(response.candidates(1).name(), slow);
  EXPECT_GT(response.candidates(0).gain().bits(), response.candidates(1).gain().bits() + 1);
  EXPECT_EQ(response.candidates(0).samples_size(), 4);
  ASSERT_EQ(response.parameters_size(), 2);
  EXPECT_NEAR(response.parameters(0).std_dev(), 0.05, 1e-12);
}

// Compares the promised uncertainty with that of the estimate. The promise is a mean over the
// prior; the estimate depends on the record's own parameters and noise. The two are near each
// other, not equal.
TEST_F(CommandTest, PromisesOfARecordWhatItsEstimateThenHas) {
  const auto design = DesignOf(Run({"design", Example("oscillator.json"), "--until", "2", "--step",
                                    "0.05", "--format", "json"}));
  const Finished run = Run(
      {"estimate", Example("oscillator.json"), File("data.csv", DemoRows(40)), "--format", "json"});
  const v1::Estimate estimate = ParseEstimate(run.out);
  for (int i = 0; i < 2; ++i) {
    const double std_dev = estimate.parameters(i).std_dev();
    EXPECT_NEAR(design.candidates(0).gain().std_dev(i), std_dev, 0.2 * std_dev);
  }
}

TEST_F(CommandTest, DesignsAfterWhatHasBeenMeasured) {
  const std::string data = File("data.csv", DemoRows(100));
  const auto after = DesignOf(
      Run({"design", Example("oscillator.json"), data, "--until", "5", "--format", "json"}));
  // The design starts from the knowledge that the estimate of this record gives.
  const Finished run = Run({"estimate", Example("oscillator.json"), data, "--format", "json"});
  const v1::Estimate estimate = ParseEstimate(run.out);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(after.parameters(i).mean(), estimate.parameters(i).mean(),
                1e-3 * estimate.parameters(i).std_dev());
    EXPECT_NEAR(after.parameters(i).std_dev(), estimate.parameters(i).std_dev(),
                1e-3 * estimate.parameters(i).std_dev());
  }
  // The experiment doubles the number of samples: both standard deviations fall by about √2, a gain
  // of one bit in all.
  EXPECT_NEAR(after.candidates(0).gain().bits(), 1, 0.1);
  EXPECT_EQ(after.candidates(0).diagnostics_size(), 0);
}

TEST_F(CommandTest, PrintsOneCsvRowAPointOfTheCost) {
  const std::string data = File("data.csv", DemoRows(20));
  const Finished run = Run({"cost", Example("oscillator.json"), data, "--grid", "3", "--parameter",
                            "k", "--format", "csv"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const auto lines = Lines(run.out);
  ASSERT_THAT(lines, SizeIs(4));
  EXPECT_EQ(lines[0], "k,mismatch,prior,total");
  // The table ends at the prior's bounds, but for rounding.
  EXPECT_NEAR(std::stod(lines[1]), 31.584, 1e-9);
  EXPECT_NEAR(std::stod(lines[3]), 47.376, 1e-9);
}

TEST_F(CommandTest, PrintsThePosteriorOfTheDemonstrationRecord) {
  const Finished run = Run({"posterior", Example("oscillator.json"), Example("oscillator.csv"),
                            "--quantiles", "0.05,0.95", "--format", "csv"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const auto lines = Lines(run.out);
  ASSERT_THAT(lines, SizeIs(3));
  EXPECT_EQ(lines[0], "parameter,mean,stdDev,q0.05,q0.95,effectiveSampleSize,rHat");
  EXPECT_THAT(lines[1], StartsWith("k,41.2"));
  EXPECT_THAT(lines[2], StartsWith("c,0.2"));
  const Finished table = Run({"posterior", Example("oscillator.json"), Example("oscillator.csv")});
  ASSERT_EQ(table.exit_status, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("importance sampling"));
  EXPECT_THAT(table.out, HasSubstr("97.5 %"));
}

TEST_F(CommandTest, PrintsSamplesOfThePosterior) {
  const std::string data = File("data.csv", DemoRows(100));
  const Finished run =
      Run({"posterior", Example("oscillator.json"), data, "--samples", "1000", "--format", "csv"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const auto lines = Lines(run.out);
  ASSERT_THAT(lines, SizeIs(1001));
  EXPECT_EQ(lines[0], "k,c");
  for (size_t i = 1; i < lines.size(); ++i) {
    const double k = std::stod(lines[i]);
    EXPECT_GT(k, 31.584);  // the prior's bounds
    EXPECT_LT(k, 47.376);
  }
}

TEST_F(CommandTest, PrintsAJointDensityOfThePosterior) {
  const std::string data = File("data.csv", DemoRows(100));
  const Finished run =
      Run({"posterior", Example("oscillator.json"), data, "--joint", "k,c", "--format", "csv"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const auto lines = Lines(run.out);
  ASSERT_THAT(lines, SizeIs(1 + 40 * 40));
  EXPECT_EQ(lines[0], "first,second,firstValue,secondValue,density");
  EXPECT_THAT(lines[1], StartsWith("k,c,"));
}

TEST_F(CommandTest, PrintsOneCsvRowAValueOfAProfile) {
  const Finished run = Run({"profile", Example("oscillator.json"), Example("oscillator.csv"),
                            "--parameter", "c", "--points", "5", "--format", "csv"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const auto lines = Lines(run.out);
  ASSERT_THAT(lines, SizeIs(6));
  EXPECT_EQ(lines[0], "parameter,value,total,mismatch,prior,k,c");
  EXPECT_THAT(lines[3], StartsWith("c,0.230"));  // the middle row is the minimum
}

TEST_F(CommandTest, PrintsOneCsvRowAWeightOfARegularizationAndDrawsIt) {
  const std::string plot = folder_ / "sweep.svg";
  const Finished run =
      Run({"regularization", Example("oscillator.json"), Example("oscillator.csv"), "--lowest",
           "0.1", "--highest", "10", "--points", "3", "--format", "csv", "--plot", plot});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const auto lines = Lines(run.out);
  ASSERT_THAT(lines, SizeIs(4));
  EXPECT_EQ(lines[0],
            "regularization,mismatch,prior,effectiveParameters,logEvidence,k,k_stdDev,c,c_stdDev");
  EXPECT_THAT(lines[2], StartsWith("1,"));
  EXPECT_TRUE(std::filesystem::file_size(plot) > 1000);
}

TEST_F(CommandTest, RefusesARangeOfWeightsThatIsNone) {
  const Finished run = Run({"regularization", Example("oscillator.json"), Example("oscillator.csv"),
                            "--lowest", "2", "--highest", "1"});
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(run.err, HasSubstr("lowest: 2 must be below highest, 1"));
}

TEST_F(CommandTest, RunsAnExperimentOfThePaper) {
  const std::string plot = folder_ / "figure.svg";
  const Finished run = Run({"paper", "5", "--plot", plot});
  EXPECT_EQ(run.exit_status, 0) << run.err;
  EXPECT_FALSE(run.out.empty());
  EXPECT_GT(std::filesystem::file_size(plot), 100u);
}

TEST_F(CommandTest, ExplainsItself) {
  const Finished help = Run({"--help"});
  EXPECT_EQ(help.exit_status, 0);
  for (const char* const command :
       {"estimate", "stream", "propagate", "cost", "models", "paper", "sensitivity", "design",
        "posterior", "profile", "regularization"}) {
    EXPECT_THAT(help.out, HasSubstr(command));
    EXPECT_EQ(Run({command, "--help"}).exit_status, 0);
  }
  const Finished version = Run({"--version"});
  EXPECT_EQ(version.exit_status, 0);
  EXPECT_THAT(version.out, StartsWith("polyest "));
}

}  // namespace
}  // namespace polyest::internal
