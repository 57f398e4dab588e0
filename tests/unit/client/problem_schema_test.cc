// Checks that the schema for editors accepts what polyest accepts, and finds common mistakes.

#include "proto/problem_schema.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "client/cli/starting_problem.h"
#include "polyest/catalogue.h"

namespace polyest::internal {
namespace {

using google::protobuf::Struct;
using google::protobuf::Value;
using ::testing::HasSubstr;

Value Parse(const std::string& json) {
  Value value;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &value);
  EXPECT_TRUE(status.ok()) << status.ToString() << "\n" << json;
  return value;
}

// Validates by JSON Schema draft-07, as far as the schema of problems uses it. An unknown keyword
// is an error. Returns the first thing wrong, or nothing.
class Validator {
 public:
  explicit Validator(const std::string& schema) : root_(Parse(schema).struct_value()) {}

  std::string Check(const Value& value) const { return Check(root_, value, "problem"); }

 private:
  using Members = google::protobuf::Map<std::string, Value>;

  std::string Check(const Struct& schema, const Value& value, const std::string& path) const {
    for (const auto& [keyword, rule] : schema.fields()) {
      const std::string wrong = CheckKeyword(keyword, rule, schema, value, path);
      if (!wrong.empty()) return wrong;
    }
    return "";
  }

  std::string CheckKeyword(const std::string& keyword, const Value& rule, const Struct& schema,
                           const Value& value, const std::string& path) const {
    static const std::set<std::string> notes = {"$schema", "title", "description", "definitions",
                                                "enumDescriptions"};
    if (notes.contains(keyword)) return "";
    if (keyword == "$ref") return Check(Definition(rule.string_value()), value, path);
    if (keyword == "type") return CheckType(rule, value, path);
    if (keyword == "enum") return CheckEnum(rule, value, path);
    if (keyword == "const") {
      return value.has_string_value() && rule.string_value() == value.string_value() ? "" : path;
    }
    if (keyword == "minimum") return value.number_value() >= rule.number_value() ? "" : path;
    if (keyword == "required") return CheckRequired(rule, value, path);
    if (keyword == "properties") return "";  // is handled with additionalProperties
    if (keyword == "additionalProperties") return CheckMembers(rule, schema, value, path);
    if (keyword == "items") return CheckItems(rule, value, path);
    if (keyword == "not") return Check(rule.struct_value(), value, path).empty() ? path : "";
    const int all = rule.list_value().values_size();
    int passed = 0;
    std::string wrong;
    for (const Value& part : rule.list_value().values()) {
      const std::string of_part = Check(part.struct_value(), value, path);
      of_part.empty() ? void(++passed) : void(wrong = of_part);
    }
    if (keyword == "allOf") return passed == all ? "" : wrong;
    if (keyword == "anyOf") return passed > 0 ? "" : wrong;
    if (keyword == "oneOf") return passed == 1 ? "" : absl::StrCat(path, ": ", passed, " of oneOf");
    return absl::StrCat("the schema has the keyword ", keyword);
  }

  const Struct& Definition(absl::string_view reference) const {
    EXPECT_TRUE(absl::ConsumePrefix(&reference, "#/definitions/")) << reference;
    const Members& definitions = root_.fields().at("definitions").struct_value().fields();
    return definitions.at(std::string(reference)).struct_value();
  }

  static std::string CheckType(const Value& rule, const Value& value, const std::string& path) {
    if (rule.has_list_value()) {
      for (const Value& type : rule.list_value().values()) {
        if (CheckType(type, value, path).empty()) return "";
      }
      return absl::StrCat(path, ": wrong type");
    }
    const std::string& type = rule.string_value();
    const bool integer =
        value.has_number_value() && std::rint(value.number_value()) == value.number_value();
    const bool passed = (type == "object" && value.has_struct_value()) ||
                        (type == "array" && value.has_list_value()) ||
                        (type == "string" && value.has_string_value()) ||
                        (type == "boolean" && value.has_bool_value()) ||
                        (type == "number" && value.has_number_value()) ||
                        (type == "integer" && integer);
    return passed ? "" : absl::StrCat(path, ": must be ", type);
  }

  static std::string CheckEnum(const Value& rule, const Value& value, const std::string& path) {
    const auto& names = rule.list_value().values();
    const bool found = std::any_of(names.begin(), names.end(), [&](const Value& name) {
      return value.has_string_value() && name.string_value() == value.string_value();
    });
    return found ? "" : absl::StrCat(path, ": not one of the names");
  }

  static std::string CheckRequired(const Value& rule, const Value& value, const std::string& path) {
    for (const Value& name : rule.list_value().values()) {
      if (!value.struct_value().fields().contains(name.string_value())) {
        return absl::StrCat(path, ": ", name.string_value(), " is missing");
      }
    }
    return "";
  }

  std::string CheckMembers(const Value& rule, const Struct& schema, const Value& value,
                           const std::string& path) const {
    static const Struct none;
    const auto properties = schema.fields().find("properties");
    const Struct& known =
        properties == schema.fields().end() ? none : properties->second.struct_value();
    for (const auto& [name, member] : value.struct_value().fields()) {
      const std::string place = absl::StrCat(path, ".", name);
      const auto found = known.fields().find(name);
      if (found == known.fields().end() && rule.has_bool_value()) {
        return absl::StrCat(place, ": is unknown");
      }
      const Value& rules = found == known.fields().end() ? rule : found->second;
      const std::string wrong = Check(rules.struct_value(), member, place);
      if (!wrong.empty()) return wrong;
    }
    return "";
  }

  std::string CheckItems(const Value& rule, const Value& value, const std::string& path) const {
    for (const Value& item : value.list_value().values()) {
      const std::string wrong = Check(rule.struct_value(), item, path + "[]");
      if (!wrong.empty()) return wrong;
    }
    return "";
  }

  Struct root_;
};

std::string WrongWith(const std::string& problem) {
  static const Validator validator{std::string(kProblemSchema)};
  return validator.Check(Parse(problem));
}

TEST(ProblemSchema, TakesEveryExample) {
  int problems = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(POLYEST_SOURCE_DIR) / "client/examples")) {
    if (entry.path().extension() != ".json") continue;
    ++problems;
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    EXPECT_EQ(WrongWith(text.str()), "") << entry.path();
  }
  EXPECT_GE(problems, 7);
}

TEST(ProblemSchema, TakesEveryProblemToStartFrom) {
  for (const auto& model : BuiltinModels()) {
    EXPECT_EQ(WrongWith(StartingProblem(model->description())), "") << model->description().name;
  }
  EXPECT_EQ(WrongWith(kStartingEquations), "");
}

TEST(ProblemSchema, TakesNumbersThatJsonCannotSay) {
  EXPECT_EQ(
      WrongWith(
          R"({"model": {"builtin": "bicycle"}, "uncertain": [], "fixed": {"mu": "Infinity"}})"),
      "");
  EXPECT_NE(WrongWith(R"({"model": {"builtin": "bicycle"}, "fixed": {"mu": "much"}})"), "");
}

TEST(ProblemSchema, WantsNoBoundsOfAKnownRate) {
  EXPECT_EQ(WrongWith(R"({"model": {"builtin": "duffing"}, "uncertain": [
      {"name": "k", "normal": {"mean": 1, "stdDev": 1},
       "drift": {"randomWalk": {"stdDevPerSqrtS": 0.1}}}],
      "processNoise": [{"state": "v", "spectralDensity": 0.01}]})"),
            "");
}

TEST(ProblemSchema, SeesMistakes) {
  const auto with = [](const std::string& members) {
    const bool has_uncertain = members.find("uncertain") != std::string::npos;
    return WrongWith(R"({"model": {"builtin": "duffing"}, )" +
                     (has_uncertain ? "" : std::string(R"("uncertain": [], )")) + members + "}");
  };
  EXPECT_EQ(WrongWith("{}"), "problem: model is missing");
  EXPECT_NE(WrongWith(R"({"model": {}})"), "");
  EXPECT_NE(WrongWith(R"({"model": {"builtin": "duffing", "fmu": "duffing"}})"), "");
  EXPECT_EQ(with(R"("mesured": [])"), "problem.mesured: is unknown");
  EXPECT_EQ(with(R"("regularization_mode": "FIXED")"), "problem.regularization_mode: is unknown");
  EXPECT_EQ(with(R"("regularizationMode": "L_CURV")"),
            "problem.regularizationMode: not one of the names");
  EXPECT_EQ(with(R"("expansion": {"order": 2.5})"), "problem.expansion.order");
  EXPECT_EQ(with(R"("expansion": {"order": 0})"), "problem.expansion.order");
  EXPECT_EQ(with(R"("expansion": {"order": "auto"})"), "problem.expansion.order");
  EXPECT_EQ(with(R"("expansion": {"order": "AUTO"})"), "");
  EXPECT_EQ(with(R"("expansion": {"order": 7})"), "");
  EXPECT_EQ(with(R"("columns": {"x": {"from": "Disp [mm]", "unit": "mm"}, "t": {"unit": "ms"}})"),
            "");
  EXPECT_EQ(with(R"("columns": {"x": {"form": "Disp [mm]"}})"),
            "problem.columns.x.form: is unknown");
  EXPECT_EQ(with(R"("measured": [{"output": "x"}])"), "problem.measured[]: noise is missing");
  EXPECT_EQ(with(R"("uncertain": [{"name": "k"}])"), "problem.uncertain[]: 0 of oneOf");
  EXPECT_EQ(with(R"("uncertain": [{"name": "k", "uniform": {"lower": 0, "upper": 1},
                                     "normal": {"mean": 0, "stdDev": 1}}])"),
            "problem.uncertain[]: 2 of oneOf");
  EXPECT_EQ(with(R"("uncertain": [{"name": "k", "uniform": {"upper": 1}}])"),
            "problem.uncertain[].uniform: lower is missing");
}

TEST(ProblemSchema, ExplainsEveryField) {
  EXPECT_THAT(kProblemSchema,
              HasSubstr("\"description\": \"The uncertain quantities, each with its prior."));
  EXPECT_THAT(kProblemSchema, HasSubstr("Whether a natural cubic spline runs"));
}

}  // namespace
}  // namespace polyest::internal
