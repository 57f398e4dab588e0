#include "polyest/problem_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace polyest::internal::problem_file_test {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string ErrorOf(const std::string& json) {
  const auto problem = ParseProblem(json, "problem.json");
  EXPECT_EQ(problem.status().code(), absl::StatusCode::kInvalidArgument) << json;
  EXPECT_EQ(problem.status().message().find('\n'), absl::string_view::npos);
  return std::string(problem.status().message());
}

TEST(ParseProblem, ReadsTheContractsExample) {
  const auto problem = ParseProblem(R"({
    "model": {"builtin": "mass_spring_damper"},
    "fixed": {"m": 1.0, "x0": 1.0},
    "uncertain": [
      {"name": "k",  "uniform": {"lower": 31.58, "upper": 47.37}},
      {"name": "c",  "normal":  {"mean": 0.2, "stdDev": 0.03}},
      {"name": "v0", "beta":    {"alpha": 2, "beta": 2, "lower": 0.5, "upper": 1.5}},
      {"name": "g",  "gamma":   {"shape": 4, "scale": 0.1, "shift": 0}}
    ],
    "inputs":   [{"name": "force", "sinusoid": {"amplitude": 1.0, "frequencyHz": 0.5,
                                                "phaseRad": 1.5707963}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01, "relative": 0.0,
                                           "relativeToMax": 0.0}}],
    "expansion": {"order": 3, "pointsPerTerm": 2, "points": "HALTON", "adaptive": true},
    "regularization": 1.0
  })",
                                    "problem.json");
  ASSERT_TRUE(problem.ok()) << problem.status();
  EXPECT_EQ(problem->model().builtin(), "mass_spring_damper");
  EXPECT_EQ(problem->fixed().at("x0"), 1.0);
  ASSERT_EQ(problem->uncertain_size(), 4);
  EXPECT_EQ(problem->uncertain(1).normal().std_dev(), 0.03);
  EXPECT_EQ(problem->inputs(0).sinusoid().frequency_hz(), 0.5);
  EXPECT_EQ(problem->expansion().points(), v1::ExpansionOptions::HALTON);
}

TEST(ParseProblem, NamesAFieldThatThereIsNot) {
  EXPECT_EQ(ErrorOf(R"({"modle": {}})"),
            "problem.json: modle: unknown field; did you mean \"model\"?");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"name": "k", "unifrom": {"lower": 1}}]})"),
            "problem.json: uncertain[0].unifrom: unknown field; did you mean \"uniform\"?");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"name": "k", "uniform": {"from": 1}}]})"),
            "problem.json: uncertain[0].uniform.from: unknown field; known names: lower, "
            "upper");
  EXPECT_EQ(ErrorOf(R"({"model": {"equations": {"tables": {"f": {"vlaue": [1]}}}}})"),
            "problem.json: model.equations.tables.f.vlaue: unknown field; did you mean "
            "\"value\"?");
}

TEST(ParseProblem, NamesAllFieldsThatThereAreNotAtOnce) {
  EXPECT_EQ(
      ErrorOf(
          R"({"modle": {}, "uncertain": [{"name": "k"}, {"unifrom": {}, "uniform": {"from": 1}}],
                        "fixed": {"anything": 1}, "expansion": {"order": "three"}})"),
      "problem.json: 3 unknown fields: modle (did you mean \"model\"?), "
      "uncertain[1].uniform.from (known names: lower, upper), uncertain[1].unifrom (did you mean "
      "\"uniform\"?)");
}

TEST(ParseProblem, TakesNamesAsTheSchemaOrTheProtoHasThem) {
  EXPECT_TRUE(
      ParseProblem(R"({"uncertain": [{"normal": {"stdDev": 1}, "per_run": true}]})", "p").ok());
}

TEST(ParseProblem, SaysThatDataAreNoProblem) {
  EXPECT_EQ(ErrorOf("t,x\n0,1\n"), "problem.json: is CSV data; a problem is one JSON object");
}

TEST(ParseProblem, NamesAFieldOfTheWrongType) {
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"uniform": {"lower": "low"}}]})"),
            "problem.json: uncertain[0].uniform.lower: \"low\" must be a number");
  EXPECT_EQ(ErrorOf(R"({"expansion": {"order": 2.5}})"),
            "problem.json: expansion.order: 2.5 must be a whole number");
  EXPECT_EQ(ErrorOf(R"({"expansion": {"order": 1e10}})"),
            "problem.json: expansion.order: 10000000000 must be a whole number below 2^31");
  EXPECT_EQ(ErrorOf(R"({"expansion": {"adaptive": 3}})"),
            "problem.json: expansion.adaptive: 3 must be true or false");
  EXPECT_EQ(ErrorOf(R"({"fixed": {"m": [1]}})"), "problem.json: fixed.m: a list must be a number");
  EXPECT_EQ(ErrorOf(R"({"fixed": [1]})"),
            "problem.json: fixed: a list must be an object, in braces { }");
  EXPECT_EQ(ErrorOf(R"({"uncertain": "k"})"),
            "problem.json: uncertain: \"k\" must be a list, in brackets [ ]");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"name": 5}]})"),
            "problem.json: uncertain[0].name: 5 must be a text in quotes");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"uniform": 5}]})"),
            "problem.json: uncertain[0].uniform: 5 must be an object, in braces { }");
}

// Protobuf would take each of them for another value.
TEST(ParseProblem, RefusesALostNumberAndOtherTypes) {
  EXPECT_EQ(ErrorOf(R"({"fixed": {"x0": null}})"),
            "problem.json:1:18: fixed.x0: null must be a number");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"uniform": {"lower": null, "upper": 2}}]})"),
            "problem.json:1:38: uncertain[0].uniform.lower: null must be a number");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"perRun": "yes"}]})"),
            "problem.json: uncertain[0].perRun: \"yes\" must be true or false");
  EXPECT_EQ(ErrorOf(R"({"measured": [{"noise": {"absolute": "0x10"}}]})"),
            "problem.json: measured[0].noise.absolute: \"0x10\" must be a number");
  EXPECT_EQ(ErrorOf(R"({"measured": [{"noise": {"absolute": " 0.01 "}}]})"),
            "problem.json: measured[0].noise.absolute: \" 0.01 \" must be a number");
  EXPECT_EQ(ErrorOf(R"({"measured": {"output": "x"}})"),
            "problem.json: measured: an object must be a list, in brackets [ ]");
  EXPECT_EQ(ErrorOf(R"({"expansion": {"order": "auto"}})"),
            "problem.json: expansion.order: \"auto\" must be a whole number or \"AUTO\"");
  EXPECT_TRUE(ParseProblem(R"({"measured": null, "expansion": {"order": "AUTO"}})", "p").ok());
}

TEST(ParseProblem, NamesTheWordsThatAFieldTakes) {
  EXPECT_THAT(ErrorOf(R"({"expansion": {"points": "SOBOL"}})"),
              StartsWith("problem.json: expansion.points: \"SOBOL\" must be one of HALTON, "));
  EXPECT_THAT(ErrorOf(R"({"expansion": {"points": "HALTN"}})"), EndsWith("; did you mean HALTON?"));
  // The word for an order that is found out is no wrong value.
  EXPECT_EQ(ErrorOf(R"({"expansion": {"order": "AUTO", "pointsPerTerm": "two"}})"),
            "problem.json: expansion.pointsPerTerm: \"two\" must be a number");
}

TEST(ParseProblem, RefusesAFieldUnderBothOfItsNames) {
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"normal": {"mean": 1, "stdDev": 1, "std_dev": 2}}]})"),
            "problem.json: uncertain[0].normal: stdDev and std_dev are both given, which is one "
            "field");
}

TEST(ParseProblem, RefusesASecondPrior) {
  EXPECT_THAT(ErrorOf(R"({"uncertain": [{"uniform": {}, "normal": {}}]})"),
              StartsWith("problem.json: uncertain[0]: normal and uniform are both given; only one "
                         "of uniform, normal, "));
}

// Protobuf would take it for 0.
TEST(ParseProblem, RefusesAPriorWithoutOneOfItsBounds) {
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"name": "k", "uniform": {"upper": 47.4}}]})"),
            "problem.json: uncertain[0].uniform.lower: is missing; the uniform prior of k needs "
            "lower and upper");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"name": "c", "normal": {"stdDev": 1}},
                                      {"name": "k", "uniform": {"lower": -1}}]})"),
            "problem.json: uncertain[1].uniform.upper: is missing; the uniform prior of k needs "
            "lower and upper");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"name": "c", "uniform": {"lower": 0, "upper": 1}},
                                      {"name": "k", "beta": {"alpha": 2, "beta": 2, "upper": 1}}]})"),
            "problem.json: uncertain[1].beta.lower: is missing; the beta prior of k needs lower "
            "and upper");
  EXPECT_TRUE(ParseProblem(R"({"uncertain": [{"uniform": {"lower": 0, "upper": 1.0}},
      {"uniform": {"lower": -1, "upper": "0"}}, {"beta": {"lower": 0, "upper": 1}}]})",
                           "p")
                  .ok());
}

TEST(ParseProblem, FindsLineAndColumnOfASyntaxError) {
  EXPECT_EQ(ErrorOf("{\n  \"model\": {\"builtin\": \"duffing\"},\n  \"fixed\" {\"m\": 1}\n}\n"),
            "problem.json:3:11: syntax error while parsing object separator - unexpected '{'; "
            "expected ':'");
  EXPECT_THAT(ErrorOf("{\n\"fixed\": {\n"),
              AllOf(StartsWith("problem.json:3:1: "), HasSubstr("unexpected end of input")));
  EXPECT_THAT(ErrorOf("{\"fixed\": {\"m\": NaN}}"), StartsWith("problem.json:1:17: "));
}

// Protobuf takes all of it, other programs that read problem files do not.
TEST(ParseProblem, RefusesWhatIsNotQuiteJson) {
  EXPECT_THAT(
      ErrorOf("{\"fixed\": {\"m\": 1},\n}"),
      AllOf(StartsWith("problem.json:2:1: "), HasSubstr("no comma may follow the last value")));
  EXPECT_THAT(
      ErrorOf("{'fixed': {\"m\": 1}}"),
      AllOf(StartsWith("problem.json:1:2: "), HasSubstr("names and texts stand in double quotes")));
  EXPECT_THAT(ErrorOf("{\n  fixed: {\"m\": 1}}"), StartsWith("problem.json:2:4: syntax error"));
}

TEST(ParseProblem, RefusesWhatIsNoObject) {
  EXPECT_EQ(ErrorOf(" \n"), "problem.json: is empty; it must hold one JSON object, the problem");
  EXPECT_EQ(ErrorOf("[]"), "problem.json: the file must hold one JSON object");
}

TEST(ParseProblem, RefusesDeepNestingWithoutFallingOver) {
  const std::string deep(100'000, '[');
  EXPECT_EQ(ErrorOf(deep), "problem.json:1:101: brackets are nested more than 100 deep");
  EXPECT_EQ(ErrorOf("{\"fixed\":\n{\"kt\":" + deep),
            "problem.json:2:105: brackets are nested more than 100 deep");
}

TEST(ParseProblem, RefusesAFieldThatIsGivenTwice) {
  EXPECT_EQ(ErrorOf("{\"fixed\": {\"m\": 1},\n \"fixed\": {\"c\": 2}}"),
            "problem.json:2:2: fixed: given twice");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"name": "k", "uniform": {"lower": 500, "lower": 600}}]})"),
            "problem.json:1:56: uncertain[0].uniform.lower: given twice");
}

TEST(ParseProblem, LeavesOutTheMarkOfUtf8) {
  EXPECT_TRUE(ParseProblem("\xEF\xBB\xBF{\"fixed\": {\"m\": 1}}", "problem.json").ok());
  EXPECT_EQ(ErrorOf("\xEF\xBB\xBF\n{\"fixed\" 1}"),
            "problem.json:2:10: syntax error while parsing object separator - unexpected number "
            "literal; expected ':'");
  EXPECT_THAT(ErrorOf("\xEF\xBB\xBF"), HasSubstr("is empty"));
}

TEST(ReadProblemFile, NamesAFileThatCannotBeOpened) {
  EXPECT_EQ(ReadProblemFile("/nowhere/p.json").status().message(),
            "/nowhere/p.json: cannot be opened: No such file or directory");
  EXPECT_EQ(ReadProblemFile("/").status().message(), "/: is a folder, not a file");
}

}  // namespace
}  // namespace polyest::internal::problem_file_test
