#include "proto/wire/json/json_structure.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "polyest/v1/problem.pb.h"
#include "proto/wire/json/json_format.h"

namespace polyest::internal {
namespace {

// Returns "line: what", or nothing for a text without an error.
std::string ErrorOf(const std::string& json) {
  const auto error = CheckJsonStructure(json);
  return error ? absl::StrCat(error->line, ": ", error->what) : "";
}

std::string Nested(int depth) {
  return std::string(static_cast<size_t>(depth), '[') +
         std::string(static_cast<size_t>(depth), ']');
}

TEST(JsonStructure, TakesBracketsUpToTheLimit) {
  EXPECT_EQ(ErrorOf(Nested(100)), "");
  EXPECT_EQ(ErrorOf("\n" + Nested(101)), "2: brackets are nested more than 100 deep");
  EXPECT_EQ(ErrorOf("{\"a\": " + Nested(99) + ", \"b\": " + Nested(99) + "}"), "");
  EXPECT_EQ(ErrorOf("{\"a\": " + Nested(100) + "}"), "1: brackets are nested more than 100 deep");
}

TEST(JsonStructure, CountsNoBracketsWithinStrings) {
  const std::string deep(200, '[');
  EXPECT_EQ(ErrorOf("{\"a\": \"" + deep + "\"}"), "");
  EXPECT_EQ(ErrorOf("{\"a\": \"\\\"" + deep + "\"}"), "");
  EXPECT_EQ(ErrorOf("{'a': '\"" + deep + "'}"), "");
  EXPECT_NE(ErrorOf("{\"a\": \"\\\\\"," + deep), "");
  EXPECT_NE(ErrorOf("{a: " + deep), "");  // protobuf reads names without quotes
}

TEST(JsonStructure, FindsAFieldThatIsGivenTwiceInOneObject) {
  EXPECT_EQ(ErrorOf(R"({"a": 1, "b": {"a": 1}, "c": [{"a": 1}, {"a": 2}]})"), "");
  EXPECT_EQ(ErrorOf("{\"a\": 1,\n\"b\": 2,\n\"a\": 3}"), "3: a: given twice");
  EXPECT_EQ(ErrorOf(R"({"c": [1, {"d": {"e": "a", "f": "a", "e": 2}}]})"),
            "1: c[1].d.e: given twice");
  EXPECT_EQ(ErrorOf(R"({a: 1, "a": 2})"), "1: a: given twice");
  EXPECT_EQ(ErrorOf(R"({"a:b": 1, "a": ":a", "b": "a:"})"), "");
}

TEST(JsonStructure, NamesNoFieldAtGreatLength) {
  const std::string name(1'000, 'a');
  EXPECT_EQ(ErrorOf("{\"" + name + "\": 1, \"" + name + "\": 1}"),
            "1: " + name.substr(0, 60) + "…: given twice");
  EXPECT_EQ(ErrorOf("{\"\xff\n\": 1, \"\xff\n\": 1}"), "3: \\xff\\n: given twice");
}

TEST(JsonStructure, FindsANullInAList) {
  EXPECT_EQ(ErrorOf(R"({"a": null, "b": ["null", {"c": null}]})"), "");
  EXPECT_EQ(ErrorOf(R"({"channels": [{"values": [0.96, null, 0.57]}]})"),
            "1: channels[0].values[1]: must be a value, not null");
}

TEST(JsonStructure, LeavesOtherErrorsToTheParser) {
  for (const char* const json :
       {"", "]", "}}", "{]", "\"", "\"\\", "{\"a", "{:", "[:]", "nonsense"}) {
    EXPECT_EQ(ErrorOf(json), "") << json;
  }
}

TEST(JsonStructure, IsCheckedBeforeATextIsRead) {
  v1::Problem problem;
  EXPECT_EQ(FromJson(R"({"fixed": {"m": 1}, "fixed": {}})", problem).message(),
            "line 1: fixed: given twice");
  EXPECT_EQ(FromJson("{\"fixed\": {\"kt\":" + std::string(100'000, '['), problem).message(),
            "line 1: brackets are nested more than 100 deep");
}

}  // namespace
}  // namespace polyest::internal
