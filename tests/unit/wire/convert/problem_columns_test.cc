// Checks where problems say that data files have their quantities.

#include "proto/wire/convert/problem_columns.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/convert/problem.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

std::vector<std::string> Refusals(const std::string& columns) {
  const v1::Problem problem = ProblemFromJson(absl::StrCat(R"({
    "model": {"builtin": "mass_spring_damper"},
    "uncertain": [{"name": "k", "uniform": {"lower": 30, "upper": 50}}],
    "inputs": [{"name": "force", "streamed": {}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}],
    "columns": )",
                                                           columns, "}"));
  std::vector<std::string> messages;
  for (const absl::Status& refusal : CheckProblem(problem)) {
    messages.emplace_back(refusal.message());
  }
  const absl::Status first = ToProblem(problem).status();
  EXPECT_EQ(messages.empty() ? "" : messages.front(), first.message());
  return messages;
}

TEST(ProblemColumns, MayNameEveryRecordedQuantity) {
  EXPECT_THAT(Refusals(R"({"x": {"from": "Disp [mm]", "unit": "mm"}, "force": {"unit": "kN"},
                           "t": {"from": "Zeit", "unit": "ms"}, "run": {"from": "Lauf"}})"),
              IsEmpty());
}

TEST(ProblemColumns, AreOfRecordedQuantitiesOnly) {
  EXPECT_THAT(Refusals(R"({"v": {"from": "Speed"}})"),
              ElementsAre("columns.v: is neither a measured output nor a streamed input nor named "
                          "by useWhen; known names: t, run, x, force"));
}

TEST(ProblemColumns, SaySomething) {
  EXPECT_THAT(Refusals(R"({"x": {}})"), ElementsAre(StartsWith("columns.x: from or unit must")));
}

TEST(ProblemColumns, HaveUnitsOfTheQuantity) {
  EXPECT_THAT(Refusals(R"({"x": {"unit": "kN"}, "t": {"unit": "m"}, "run": {"unit": "1"},
                           "force": {"unit": "quux"}})"),
              ElementsAre(HasSubstr("columns.force.unit: the unit \"quux\" has the unknown symbol"),
                          "columns.run.unit: run has no unit",
                          "columns.t.unit: values in \"m\" cannot be converted to \"s\": their "
                          "dimensions differ",
                          "columns.x.unit: values in \"kN\" cannot be converted to \"m\": their "
                          "dimensions differ"));
}

}  // namespace
}  // namespace polyest::internal
