// Tests `polyest compare` on the record of a linear oscillator.

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/integration/cli/same_answer.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

// What a problem file differs in.
struct Variant {
  std::string damping = "c*v";
  std::string condition = "t > 0";
  std::string noise = R"("absolute": 0.01)";
  std::string more = "";  // further fields, each with a comma behind
};

class CompareTest : public SameAnswerTest {
 protected:
  std::string ProblemFile(const std::string& name, const Variant& variant) {
    return File(name, absl::StrCat(R"({
      "model": {"equations": {"states": {"x": "v", "v": "-k*x - )",
                                   variant.damping, R"("}, "outputs": {"position": "x"}}},
      "fixed": {"x_0": 1},
      "uncertain": [{"name": "k", "uniform": {"lower": 30, "upper": 50}},
                    {"name": "c", "uniform": {"lower": 0.01, "upper": 1}}],
      "measured": [{"output": "position", "noise": {)",
                                   variant.noise, R"(}}],
      )",
                                   variant.more, R"("useWhen": ")", variant.condition, "\"}"));
  }

  // x″ = −39.5 x − 0.2 v from x = 1, whose last digits are the noise.
  static std::string Rows() {
    std::string rows = "t,position\n";
    for (int i = 1; i <= 120; ++i) {
      const double t = 0.05 * i, w = std::sqrt(39.5 - 0.01);
      const double x = std::exp(-0.1 * t) * (std::cos(w * t) + 0.1 / w * std::sin(w * t));
      rows += std::to_string(t) + ',' + std::to_string(std::round(x * 30) / 30) + '\n';
    }
    return rows;
  }

  // Returns the log score of a problem in a comparison's answer as CSV.
  static double ScoreOf(const std::string& file, const std::string& csv) {
    for (const std::string& line : Lines(csv)) {
      const std::vector<std::string> fields = absl::StrSplit(line, ',');
      if (absl::EndsWith(fields[0], file)) return std::stod(fields[2]);
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  const std::string linear_ = ProblemFile("linear.json", {});
  const std::string data_ = File("data.csv", Rows());
};

TEST_F(CompareTest, RanksTheModelOfTheDataFirst) {
  const std::string dry = ProblemFile("dry.json", {.damping = "c*sign(v)"});
  ExpectSameAnswer({"compare", dry, linear_, data_});
  ExpectSameAnswer({"compare", dry, linear_, data_, "--hold-out", "0.5", "--format", "csv"});
  const Finished compared = Run({"compare", dry, linear_, data_});
  EXPECT_THAT(Lines(compared.out)[1], HasSubstr("linear.json"));
  EXPECT_THAT(compared.out, HasSubstr("120 samples, 36 of them held out. Evidence and held-out "
                                      "samples prefer"));
}

// Filters go on reading samples, the fewer the farther they have to predict.
TEST_F(CompareTest, ScoresFiltersAtTheHorizonAskedFor) {
  const std::string filtered = ProblemFile(
      "filtered.json", {.more = R"("processNoise": [{"state": "v", "spectralDensity": 1e-2}],)"});
  const std::vector<std::string> next = {"compare", linear_, filtered, data_, "--format", "csv"};
  std::vector<std::string> ahead = next;
  ahead.insert(ahead.end(), {"--horizon", "1.5"});
  ExpectSameAnswer(ahead);
  const std::string of_next = Run(next).out, of_ahead = Run(ahead).out;
  EXPECT_EQ(ScoreOf("linear.json", of_next), ScoreOf("linear.json", of_ahead));
  EXPECT_GT(ScoreOf("filtered.json", of_next), ScoreOf("filtered.json", of_ahead));
}

TEST_F(CompareTest, ComparesNoEvidenceWhereDifferentNoisesAreUnknown) {
  const std::string unknown = ProblemFile("unknown.json", {.noise = R"("unknown": true)"});
  const Finished mixed = Run({"compare", linear_, unknown, data_});
  EXPECT_EQ(mixed.exit_status, 0) << mixed.err;
  EXPECT_THAT(mixed.out, HasSubstr("Evidence is compared only where"));
}

TEST_F(CompareTest, QuotesFileNamesThatHoldACommaInCsv) {
  const std::string odd = ProblemFile("a,b.json", {.damping = "c*sign(v)"});
  const Finished compared = Run({"compare", linear_, odd, data_, "--format", "csv"});
  EXPECT_EQ(compared.exit_status, 0) << compared.err;
  EXPECT_THAT(compared.out, HasSubstr('"' + odd + "\","));
}

TEST_F(CompareTest, RefusesWhatCannotBeCompared) {
  const auto refusal = [this](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"compare", linear_});
    const Finished refused = Run(arguments);
    EXPECT_EQ(refused.exit_status, 2);
    return refused.err;
  };
  const std::string later = ProblemFile("later.json", {.condition = "t > 1"});
  EXPECT_THAT(refusal({later, data_}),
              HasSubstr("problems can be compared only if they measure the same"));
  const std::string one = File("one.csv", "t,position\n0.5,0.1\n");
  EXPECT_THAT(refusal({linear_, one, "--hold-out", "0.3"}),
              HasSubstr("--hold-out: 0.3 of 1 rows leaves none to predict"));
  const std::string population = File("population.json", R"json({
    "model": {"equations": {"outputs": {"position": "exp(-k*t)"}}},
    "uncertain": [{"name": "k", "normal": {"mean": 2, "stdDev": 1},
                   "perRun": true, "population": true}],
    "measured": [{"output": "position", "noise": {"absolute": 0.05}}]})json");
  EXPECT_THAT(refusal({population, data_}),
              HasSubstr("population.json: uncertain[0].population: must be left out"));
  EXPECT_THAT(refusal({linear_, data_, "--horizon", "2"}),
              HasSubstr("--horizon: 2 must be left out, since none of the problems has process"));
  EXPECT_THAT(refusal(std::vector<std::string>(20, linear_)),
              HasSubstr("20 problems are more than 19"));
  for (const char* const number : {"-1", "far", "nan", "inf"}) {
    EXPECT_THAT(refusal({linear_, data_, "--horizon", number}), HasSubstr("--horizon")) << number;
    EXPECT_THAT(refusal({linear_, data_, "--hold-out", number}), HasSubstr("--hold-out")) << number;
    EXPECT_THAT(refusal({linear_, data_, "--deadline", number}), HasSubstr("--deadline")) << number;
  }
}

}  // namespace
}  // namespace polyest::internal
