// Checks that all errors of a problem are reported at once.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/check/check.h"
#include "proto/wire/convert/problem.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

std::vector<std::string> Messages(const v1::Problem& problem) {
  std::vector<std::string> messages;
  for (const absl::Status& refusal : CheckProblem(problem)) {
    messages.emplace_back(refusal.message());
  }
  return messages;
}

TEST(CheckProblem, HasNothingToSayAgainstAGoodOne) {
  EXPECT_THAT(Messages(SmallProblem()), IsEmpty());
}

TEST(CheckProblem, SaysEverythingAndToProblemTheFirstOfIt) {
  const v1::Problem problem = ProblemFromJson(R"({
    "model": {"builtin": "mass_spring_damper"},
    "fixed": {"mass": 1},
    "uncertain": [{"name": "k", "uniform": {"lower": 5, "upper": 3}},
                  {"name": "c"},
                  {"name": "stiffness", "normal": {"mean": 1, "stdDev": 1}}],
    "inputs": [{"name": "force"}, {"name": "wind", "sinusoid": {"frequencyHz": -1}}],
    "measured": [{"output": "x"}, {"output": "y", "noise": {"absolute": -1}}],
    "expansion": {"order": -1},
    "regularization": -2,
    "integration": {"maxSteps": -1}
  })");
  const std::vector<std::string> messages = Messages(problem);
  EXPECT_THAT(
      messages,
      ElementsAre(StartsWith("uncertain[0].uniform: lower 5 must be below upper 3"),
                  StartsWith("uncertain[1]: c needs a prior"),
                  StartsWith("inputs[0]: force needs a signal"), StartsWith("regularization: -2"),
                  StartsWith("expansion.order: -1"), StartsWith("integration.maxSteps: -1"),
                  StartsWith("inputs[1].sinusoid.frequencyHz: -1"),
                  StartsWith("measured[0].noise: output x needs a noise"),
                  StartsWith("measured[1].noise.absolute: -1"),
                  StartsWith("inputs[1]: model mass_spring_damper has no input \"wind\""),
                  StartsWith("measured[1]: model mass_spring_damper has no output \"y\""),
                  StartsWith("fixed.mass: model mass_spring_damper has no parameter"),
                  StartsWith("uncertain[2]: model mass_spring_damper has no parameter")));
  EXPECT_EQ(ToProblem(problem).status().message(), messages.front());
}

TEST(CheckProblem, SaysWhatItCanWithoutAModel) {
  EXPECT_THAT(Messages(ProblemFromJson(R"({
        "model": {"builtin": "rocket"},
        "uncertain": [{"name": "k", "uniform": {"lower": 5, "upper": 3}}],
        "inputs": [{"name": "u", "halfSineBump": {"amplitude": 1, "durationS": 0}}],
        "measured": [{"output": "x", "noise": {"relative": -1}}],
        "expansion": {"pointsPerTerm": 0.5}})")),
              ElementsAre(StartsWith("model.builtin: "), StartsWith("uncertain[0].uniform: "),
                          StartsWith("expansion.pointsPerTerm: 0.5"),
                          StartsWith("inputs[0].halfSineBump.durationS: 0"),
                          StartsWith("measured[0].noise.relative: -1")));
  EXPECT_THAT(Messages(v1::Problem()),
              ElementsAre(StartsWith("model: a model must be named"), StartsWith("uncertain: ")));
}

TEST(CheckProblem, LooksIntoTheModelThoughNothingIsUncertain) {
  v1::Problem problem = SmallProblem();
  problem.clear_uncertain();
  problem.mutable_measured(0)->set_output("y");
  EXPECT_THAT(Messages(problem), ElementsAre(StartsWith("uncertain: "), StartsWith("measured[0]")));
}

TEST(CheckProblem, NamesEveryEquationThatIsWrong) {
  const v1::Problem problem = ProblemFromJson(R"json({
    "model": {"equations": {"states": {"x": "v", "v": "-k*x +"},
                            "outputs": {"x": "x", "a": "sine(x)"}}},
    "uncertain": [{"name": "k", "uniform": {"lower": 5, "upper": 3}}]
  })json");
  EXPECT_THAT(Messages(problem),
              ElementsAre(StartsWith("model.equations."), StartsWith("model.equations."),
                          StartsWith("uncertain[0].uniform: ")));
}

TEST(CheckProblem, RefusesANameThatAnotherParameterHasInARun) {
  v1::Problem problem = ProblemFromJson(R"({
    "uncertain": [{"name": "k", "perRun": true}, {"name": "k[12]"}, {"name": "k[01]"},
                  {"name": "k[x]"}, {"name": "c[1]"}, {"name": "c"},
                  {"name": "k[0]", "perRun": true}]})");
  for (auto& parameter : *problem.mutable_uncertain()) parameter.mutable_uniform()->set_upper(1);
  EXPECT_THAT(Messages(problem),
              Contains("uncertain[1]: k[12] is also the name of k in run 12; one "
                       "of them must be fixed, or k must do without perRun"));
  EXPECT_THAT(Messages(problem), Contains(HasSubstr("also the name")).Times(1));
}

TEST(CheckProblem, TellsOfProcessNoise) {
  v1::CheckProblemRequest request;
  *request.mutable_problem() = SmallProblem();
  request.mutable_problem()->MergeFrom(ProblemFromJson(R"({"processNoise": [
      {"state": "x", "spectralDensity": 0.01},
      {"state": "v", "unknown": true, "lower": 0.001, "upper": 1}]})"));
  const v1::CheckProblemResponse response = CheckProblem(request);
  ASSERT_TRUE(response.errors().empty()) << response.errors(0).description();
  std::string said;
  for (const auto& remark : response.summary()) said += remark.description() + '\n';
  EXPECT_THAT(said, HasSubstr("0.01\nunknown, from 0.001 to 1"));
}

TEST(CheckProblem, TellsOfDrift) {
  v1::CheckProblemRequest request;
  *request.mutable_problem() = SmallProblem();
  auto& walk = *request.mutable_problem()->mutable_uncertain(0)->mutable_drift();
  walk.mutable_random_walk()->set_std_dev_per_sqrt_s(0.25);
  const v1::CheckProblemResponse response = CheckProblem(request);
  ASSERT_TRUE(response.errors().empty()) << response.errors(0).description();
  std::string said;
  for (const auto& remark : response.summary()) {
    said += remark.topic() + ' ' + remark.description() + '\n';
  }
  EXPECT_THAT(said, HasSubstr("drift 0.25\n"));
}

TEST(CheckProblem, TellsOfRowsLeftOutAndOfInputsWithoutSamples) {
  v1::CheckProblemRequest request;
  *request.mutable_problem() = SmallProblem();
  request.mutable_problem()->MergeFrom(ProblemFromJson(R"({
    "inputs": [{"name": "force", "streamed": {}}], "useWhen": "t > 0.25"})"));
  v1::Measurements& measurements = *request.mutable_measurements();
  v1::Measurements::Channel& x = *measurements.add_channels();
  x.set_name("x");
  for (int k = 0; k < 10; ++k) {
    measurements.add_time_s(0.1 * k);
    x.add_values(k % 3);
  }
  const v1::CheckProblemResponse response = CheckProblem(request);
  ASSERT_TRUE(response.errors().empty()) << response.errors(0).description();
  std::string said;
  for (const auto& warning : response.warnings()) said += warning.description() + '\n';
  EXPECT_THAT(said, HasSubstr("force: the streamed input has no sample in 1 run"));
  for (const auto& remark : response.summary()) said += remark.description() + '\n';
  EXPECT_THAT(said, HasSubstr("3 of them left out by useWhen"));
  EXPECT_THAT(said, HasSubstr("t > 0.25"));
}

}  // namespace
}  // namespace polyest::internal
