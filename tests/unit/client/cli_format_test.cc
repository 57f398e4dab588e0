#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include "client/cli/csv_field.h"
#include "client/cli/estimate_format.h"
#include "client/cli/name_list.h"
#include "client/cli/number_format.h"
#include "client/cli/text_table.h"
#include "polyest/v1/model_service.pb.h"
#include "polyest/v1/problem.pb.h"
#include "proto/wire/json/json_format.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

void AddCoefficient(v1::Direction& direction, const char* parameter, double value) {
  v1::Direction::Coefficient& added = *direction.add_coefficients();
  added.set_parameter(parameter);
  added.set_value(value);
}

v1::Estimate ExampleEstimate() {
  v1::Estimate estimate;
  auto& k = *estimate.add_parameters();
  k.set_name("k");
  k.set_unit("N/m");
  k.set_map(40.661234);
  k.set_std_dev(0.0052);
  k.set_mean(40.6613);
  k.set_lower95(40.6511);
  k.set_upper95(40.6715);
  k.set_prior_mean(39.48);
  k.set_prior_std_dev(4.56);
  k.set_contraction(0.00114);
  k.set_verdict(v1::Identifiability::IDENTIFIED);
  auto& mu = *estimate.add_parameters();
  mu = k;
  mu.set_name("mu");
  mu.set_unit("1");
  mu.set_verdict(v1::Identifiability::NOT_IDENTIFIED);
  auto& x = *estimate.add_channels();
  x.set_output("x");
  x.set_samples(200);
  x.set_chi_squared(198.4);
  x.set_noise_std_dev(0.01);
  auto& direction = *estimate.add_directions();
  direction.set_information(7.7e5);
  AddCoefficient(direction, "k", 0.99);
  AddCoefficient(direction, "mu", -0.1);
  direction.set_verdict(v1::Identifiability::IDENTIFIED);
  estimate.mutable_cost()->set_total(101.2);
  auto& diagnostic = *estimate.add_diagnostics();
  diagnostic.set_code(v1::Diagnostic::UNDERSAMPLED);
  diagnostic.set_message("two samples a period are not enough");
  estimate.set_time(10);
  estimate.set_samples(200);
  estimate.set_sequence(7);
  return estimate;
}

TEST(CsvField, IsQuotedWhereItWouldBeReadAsSeveral) {
  EXPECT_EQ(CsvField("k.mean"), "k.mean");
  EXPECT_EQ(CsvField("K[1,1]"), "\"K[1,1]\"");
  EXPECT_EQ(CsvField("the \"new\" k"), "\"the \"\"new\"\" k\"");
  EXPECT_EQ(CsvField("two\nlines"), "\"two\nlines\"");
  EXPECT_EQ(CsvField(""), "");
}

TEST(SplitNames, KeepsCommasWithinBrackets) {
  EXPECT_THAT(SplitNames("k,c"), ElementsAre("k", "c"));
  EXPECT_THAT(SplitNames("K[1,1],der(x[1,2],2),c"), ElementsAre("K[1,1]", "der(x[1,2],2)", "c"));
  EXPECT_THAT(SplitNames("k],c,"), ElementsAre("k]", "c", ""));
}

TEST(FormatValue, KeepsTwoDigitsOfTheUncertainty) {
  EXPECT_EQ(FormatUncertain(40.661234, 0.0052), "40.6612 ± 0.0052");
  EXPECT_EQ(FormatUncertain(40.661234, 0.00996), "40.661 ± 0.010");
  EXPECT_EQ(FormatUncertain(39.48, 4.56), "39.5 ± 4.6");
  EXPECT_EQ(FormatUncertain(1000.4, 223.6), "1000 ± 224");
  EXPECT_EQ(FormatUncertain(-0.000123456, 1.2e-8), "-1.23456e-04 ± 1.2e-08");
  EXPECT_EQ(FormatUncertain(1.23456e9, 1.5e5), "1.23456e+09 ± 1.5e+05");
}

TEST(FormatValue, LeavesOutZerosThatSayNothing) {
  EXPECT_EQ(FormatUncertain(0.000015, 0.000059), "1.5e-05 ± 5.9e-05");
  EXPECT_EQ(FormatUncertain(0.00015, 0.000059), "0.000150 ± 0.000059");
}

TEST(FormatInterval, HasDigitsAtBothEnds) {
  EXPECT_EQ(FormatInterval(40.6510, 40.6714, 0.0052), "40.6510 … 40.6714");
  EXPECT_EQ(FormatInterval(-0.2, 12.3, 3.1), "-0.2 … 12.3");
  EXPECT_EQ(FormatInterval(0.1, 9.8, 2.4), "0.1 … 9.8");
  EXPECT_EQ(FormatInterval(1.114e-7, 2.2126e-5, 5.9e-5), "1.1e-07 … 2.2e-05");
  EXPECT_EQ(FormatInterval(-9.8, -0.0021, 2.4), "-9.8 … -0.0021");
  EXPECT_EQ(FormatInterval(0, 0.3, 0.1), "0.00 … 0.30");
}

TEST(FormatValue, ManagesWithoutAnUncertainty) {
  EXPECT_EQ(FormatValue(1.23456789, 0), "1.23457");
  EXPECT_EQ(FormatValue(0, 1e-12), "0.0e+00");
  EXPECT_EQ(FormatValue(2, std::numeric_limits<double>::infinity()), "2");
}

TEST(FormatNumber, NamesWhatIsInfinite) {
  EXPECT_EQ(FormatNumber(std::numeric_limits<double>::infinity(), 6), "inf");
}

TEST(FormatExact, IsReadBackAsTheSameNumber) {
  EXPECT_EQ(FormatExact(0.1), "0.1");
  EXPECT_EQ(std::stod(FormatExact(1.0 / 3)), 1.0 / 3);
  EXPECT_EQ(FormatExact(std::numeric_limits<double>::infinity()), "inf");
}

TEST(TextTable, AlignsByWhatIsSeen) {
  TextTable left({"a", "value", "unit"});
  left.AddRow({"long", "1 ± 2", "N"});
  left.AddRow({"b", "1", ""});
  std::ostringstream out;
  left.Print(out);
  EXPECT_EQ(out.str(), "a     value  unit\nlong  1 ± 2  N\nb     1\n");

  TextTable right({"t", "x"}, TextTable::Align::kRight);
  right.AddRow({"10", "−1"});
  std::ostringstream numbers;
  right.Print(numbers);
  EXPECT_EQ(numbers.str(), " t   x\n10  −1\n");
}

TEST(PrintEstimate, SaysInWordsWhatIsKnown) {
  std::ostringstream out;
  PrintEstimate(ExampleEstimate(), out);
  const std::string text = out.str();
  EXPECT_THAT(text, HasSubstr("200 samples up to t = 10 s"));
  EXPECT_THAT(text, HasSubstr("k          40.6612 ± 0.0052  N/m   40.6511 … 40.6715  39.5 ± 4.6"));
  EXPECT_THAT(text, HasSubstr("not identified\n"));
  EXPECT_THAT(text, HasSubstr("x        200      198.4  0.992       0.01"));
  EXPECT_THAT(text, HasSubstr("0.99 k − 0.10 mu"));
  EXPECT_THAT(text, HasSubstr("note: undersampled: two samples a period are not enough\n"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(EstimateText, IsThePosteriorsMeanWhereTheDataTellLessThanThePrior) {
  v1::ParameterEstimate p;
  p.set_map(0.15);
  p.set_std_dev(0.5);
  p.set_mean(0.29);
  p.set_posterior_std_dev(0.44);
  p.set_verdict(v1::Identifiability::WEAK);
  EXPECT_EQ(EstimateText(p), "0.15 ± 0.50");
  p.set_verdict(v1::Identifiability::NOT_IDENTIFIED);
  EXPECT_EQ(EstimateText(p), "0.29 ± 0.44");
}

TEST(EstimateText, IsThePosteriorsMeanWhereThePosteriorIsInSeveralPieces) {
  v1::ParameterEstimate p;
  p.set_map(0.80);
  p.set_std_dev(0.01);
  p.set_mean(0.1);
  p.set_posterior_std_dev(0.75);
  p.set_prior_std_dev(0.72);
  p.set_verdict(v1::Identifiability::WEAK);
  EXPECT_EQ(EstimateText(p), "0.10 ± 0.75");
}

TEST(PrintEstimate, DividesByNoSamples) {
  v1::Estimate estimate = ExampleEstimate();
  estimate.mutable_channels(0)->set_samples(0);
  std::ostringstream out;
  PrintEstimate(estimate, out);
  EXPECT_THAT(out.str(), HasSubstr("x        0        -   -           -         -      -\n"));
}

TEST(PrintEstimate, SaysHowTheNoiseIsCorrelated) {
  v1::Estimate estimate = ExampleEstimate();
  estimate.mutable_channels(0)->set_noise_time_constant_s(2);
  std::ostringstream all, in_part;
  PrintEstimate(estimate, all);
  EXPECT_THAT(all.str(), HasSubstr("\nx: noise correlated over 2 s\n"));
  estimate.mutable_channels(0)->set_noise_white_share(0.3);
  PrintEstimate(estimate, in_part);
  EXPECT_THAT(in_part.str(), HasSubstr("\nx: noise correlated over 2 s, but for the 30 % of its "
                                       "variance that is white\n"));
}

TEST(EstimateLine, ShowsTimeAndEveryParameter) {
  EXPECT_EQ(EstimateLine(ExampleEstimate()),
            "t = 10 s  k = 40.6612 ± 0.0052 N/m  mu = 40.6612 ± 0.0052");
}

TEST(DirectionText, LeavesOutWhatIsTooSmallToMatter) {
  v1::Direction direction;
  AddCoefficient(direction, "k", -1);
  AddCoefficient(direction, "mu", 0.01);
  EXPECT_EQ(DirectionText(direction), "−1.00 k");
}

TEST(ToJson, HasTheContractsNames) {
  const std::string json = ToJson(ExampleEstimate(), /*several_lines=*/false);
  EXPECT_EQ(json.find('\n'), std::string::npos);
  EXPECT_THAT(json, HasSubstr(R"("parameters":[{"name":"k","unit":"N/m","map":40.661234,)"
                              R"("stdDev":0.0052,"mean":40.6613,"lower95":40.6511,)"
                              R"("upper95":40.6715,"priorMean":39.48,"priorStdDev":4.56,)"
                              R"("contraction":0.00114,"verdict":"IDENTIFIED")"));
  EXPECT_THAT(json, HasSubstr(R"("chiSquared":198.4,"noiseStdDev":0.01)"));
  EXPECT_THAT(json, HasSubstr(R"("diagnostics":[{"code":"UNDERSAMPLED")"));
  EXPECT_THAT(json, HasSubstr(R"("coefficients":{"k":0.99,"mu":-0.1})"));
  EXPECT_THAT(json, HasSubstr(R"("time":10,"samples":"200","sequence":"7")"));
}

TEST(FromJson, ReadsWhatToJsonWrites) {
  const v1::Estimate estimate = ExampleEstimate();
  v1::Estimate again;
  const absl::Status read = FromJson(ToJson(estimate, /*several_lines=*/true), again);
  ASSERT_TRUE(read.ok()) << read;
  EXPECT_EQ(again.SerializeAsString(), estimate.SerializeAsString());
  EXPECT_TRUE(absl::IsInvalidArgument(FromJson("{\"directions\": 3}", again)));
}

TEST(ToJson, IsTheSameForTheSameMessage) {
  v1::Problem first;
  v1::Problem second;
  for (int i = 0; i < 20; ++i) (*first.mutable_fixed())[std::to_string(i)] = i;
  for (int i = 19; i >= 0; --i) (*second.mutable_fixed())[std::to_string(i)] = i;
  EXPECT_EQ(ToJson(first, /*several_lines=*/true), ToJson(second, /*several_lines=*/true));
}

TEST(ToJson, WritesAnInfiniteDefaultAsJsonSays) {
  v1::Model model;
  model.add_parameters()->set_default_value(std::numeric_limits<double>::infinity());
  const std::string json = ToJson(model, /*several_lines=*/false);
  EXPECT_THAT(json, HasSubstr(R"("defaultValue":"Infinity")"));
  v1::Model again;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(json, &again).ok());
  EXPECT_EQ(again.parameters(0).default_value(), std::numeric_limits<double>::infinity());
}

TEST(ToJson, PrintsWhatHasItsDefault) {
  const std::string json = ToJson(v1::Estimate(), /*several_lines=*/true);
  EXPECT_THAT(json, HasSubstr("\"covariance\": []"));
  EXPECT_THAT(json, HasSubstr("\"time\": 0"));
}

}  // namespace
}  // namespace polyest::internal
