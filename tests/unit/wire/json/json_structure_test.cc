#include "proto/wire/json/json_structure.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "core/common/utf8.h"
#include "polyest/v1/problem.pb.h"
#include "proto/wire/json/json_format.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Returns "line:column: what", or nothing for a text without an error.
std::string ErrorOf(const std::string& json) {
  const auto error = CheckJsonStructure(json, *v1::Problem::descriptor());
  return error ? absl::StrCat(error->line, ":", error->column, ": ", error->Sentence()) : "";
}

std::string Nested(int depth) {
  return std::string(static_cast<size_t>(depth), '[') +
         std::string(static_cast<size_t>(depth), ']');
}

TEST(JsonStructure, TakesWhatTheStandardTakes) {
  for (const char* const json :
       {"{}", "[]", " \t\r\n{ \"a\" : [ ] , \"b\" : { } }\n", "0", "-0", "12.50e+3", "1E-7",
        "[true, false, -1.5, \"\"]", R"({"": "\"\\\/\b\f\n\r\t\u00e4\uD83D\ude00"})",
        "{\"Gr\u00f6\u00dfe\": \"\u00b5m \U0001F600\"}", "1e-400"}) {
    EXPECT_EQ(ErrorOf(json), "") << json;
  }
}

TEST(JsonStructure, RefusesWhatOnlyLenientParsersTake) {
  for (const auto& [json, place, hint] : std::vector<std::array<std::string, 3>>{
           {"{\"a\": 1,\n }", "2:2", "no comma may follow the last value"},
           {"[1, [2, ], 3]", "1:9", "no comma may follow the last value"},
           {"{'a': 1}", "1:2", "names and texts stand in double quotes"},
           {"{\"a\":\n  'x'}", "2:3", "names and texts stand in double quotes"},
           {"{\"a\": 1} // x", "1:10", "JSON has no comments"},
           {"{\"a\": 1} /* x */", "1:10", "JSON has no comments"},
           {"{\"a\": 1} # x", "1:10", "JSON has no comments"},
           {"{a: 1}", "1:2", "last read: '{a'; expected string literal"},
           {"{\"a\": 1}\v", "1:9", "expected end of input"}}) {
    EXPECT_THAT(ErrorOf(json),
                AllOf(StartsWith(place + ": syntax error while parsing "), EndsWith("; " + hint)));
  }
}

TEST(JsonStructure, RefusesOtherNumbers) {
  for (const char* const number : {"+1", ".5", "1.", "007", "0x10", "1e", "1e+", "-", "1_000",
                                   "--1", "1.5.2", "-Infinity", "NaN"}) {
    EXPECT_THAT(ErrorOf(absl::StrCat("[", number, "]")), HasSubstr(": syntax error while parsing "))
        << number;
  }
  EXPECT_EQ(ErrorOf("[1e400]"), "1:6: number overflow parsing '1e400'");
  EXPECT_THAT(ErrorOf("[1" + std::string(400, '0') + "]"),
              AllOf(HasSubstr(": number overflow parsing '1000"), EndsWith("0…")));
}

TEST(JsonStructure, SaysWhatMustStandWhereAnotherThingStands) {
  EXPECT_EQ(
      ErrorOf("{\"a\" 1}"),
      "1:6: syntax error while parsing object separator - unexpected number literal; expected "
      "':'");
  EXPECT_EQ(ErrorOf("[1}"), "1:3: syntax error while parsing array - unexpected '}'; expected ']'");
  EXPECT_EQ(ErrorOf("{}}"),
            "1:3: syntax error while parsing value - unexpected '}'; expected end of input");
  for (const char* const json : {"", "{\"a\"", "[1,\n", "{,}", "{[]: 1}", "{:1}", "[,]", "]",
                                 "{\"a\": }", "[1 2]", "{}{}", "nonsense", "True"}) {
    EXPECT_THAT(ErrorOf(json), HasSubstr(": syntax error while parsing ")) << json;
  }
  EXPECT_THAT(ErrorOf("{\n \"a\": [1,\n"), StartsWith("3:1: "));
}

TEST(JsonStructure, RefusesTextsThatAreNotWhole) {
  EXPECT_EQ(ErrorOf(R"(["C:\rig"])"), "");
  EXPECT_THAT(ErrorOf(R"(["C:\data"])"), HasSubstr("forbidden character after backslash"));
  EXPECT_THAT(ErrorOf("{\"a"), HasSubstr("missing closing quote"));
  EXPECT_THAT(ErrorOf("[\"a\tb\"]"), HasSubstr("control character U+0009 (HT) must be escaped"));
  EXPECT_THAT(ErrorOf(R"(["\ud83d"])"), HasSubstr("surrogate"));
  // What is not UTF-8 is no part of the message either.
  const std::string error = ErrorOf("[\"Gr\xf6\xdf\"]");
  EXPECT_THAT(error, HasSubstr("ill-formed UTF-8 byte"));
  EXPECT_TRUE(IsUtf8(error));
  EXPECT_LT(ErrorOf("[\"" + std::string(1'000, 'x')).size(), 250u);
}

TEST(JsonStructure, CountsColumnsInCharacters) {
  EXPECT_THAT(ErrorOf("{\"\u00b5\": 1,}"), StartsWith("1:9: "));
}

TEST(JsonStructure, TakesBracketsUpToTheLimit) {
  EXPECT_EQ(ErrorOf(Nested(100)), "");
  EXPECT_EQ(ErrorOf("\n" + Nested(101)), "2:101: brackets are nested more than 100 deep");
  EXPECT_EQ(ErrorOf("{\"a\": " + Nested(99) + ", \"b\": " + Nested(99) + "}"), "");
  EXPECT_EQ(ErrorOf("{\"a\": " + Nested(100) + "}"),
            "1:106: brackets are nested more than 100 deep");
}

TEST(JsonStructure, CountsNoBracketsWithinStrings) {
  const std::string deep(200, '[');
  EXPECT_EQ(ErrorOf("{\"a\": \"" + deep + "\"}"), "");
  EXPECT_EQ(ErrorOf("{\"a\": \"\\\"" + deep + "\"}"), "");
}

TEST(JsonStructure, FindsAFieldThatIsGivenTwiceInOneObject) {
  EXPECT_EQ(ErrorOf(R"({"a": 1, "b": {"a": 1}, "c": [{"a": 1}, {"a": 2}]})"), "");
  EXPECT_EQ(ErrorOf("{\"a\": 1,\n\"b\": 2,\n\"a\": 3}"), "3:1: a: given twice");
  EXPECT_EQ(ErrorOf(R"({"c": [1, {"d": {"e": "a", "f": "a", "e": 2}}]})"),
            "1:38: c[1].d.e: given twice");
  EXPECT_EQ(ErrorOf(R"({"\u0061": 1, "\\u0061": 2, "\/": 3, "/b": 4, "\"": 5, "\u00e4": 6})"), "");
  EXPECT_EQ(ErrorOf(R"({"a:b": 1, "a": ":a", "b": "a:"})"), "");
  EXPECT_EQ(ErrorOf(R"({"a": 1, "\u0061": 2})"), "1:10: a: given twice");
}

TEST(JsonStructure, NamesNoFieldAtGreatLength) {
  const std::string name(1'000, 'a');
  EXPECT_EQ(ErrorOf("{\"" + name + "\": 1, \"" + name + "\": 1}"),
            "1:1009: " + name.substr(0, 60) + "…: given twice");
}

TEST(JsonStructure, FindsANullInAList) {
  EXPECT_EQ(ErrorOf(R"({"a": null, "b": ["null", {"c": null}]})"), "");
  EXPECT_EQ(ErrorOf(R"({"channels": [{"values": [0.96, null, 0.57]}]})"),
            "1:33: channels[0].values[1]: must be a value, not null");
}

TEST(JsonStructure, FindsANullInPlaceOfAValue) {
  EXPECT_EQ(ErrorOf(R"({"model": null, "measured": null, "fixed": null, "unknown": null})"), "");
  EXPECT_EQ(ErrorOf(R"({"fixed": {"m": 1, "x0": null}})"), "1:26: fixed.x0: null must be a number");
  EXPECT_EQ(ErrorOf("{\"uncertain\": [{}, {\"uniform\":\n{\"lower\": null}}]}"),
            "2:11: uncertain[1].uniform.lower: null must be a number");
  EXPECT_EQ(ErrorOf(R"({"measured": [{"noise": {"unknown": null}}]})"),
            "1:37: measured[0].noise.unknown: null must be true or false");
  EXPECT_EQ(ErrorOf(R"({"uncertain": [{"per_run": null}]})"),
            "1:28: uncertain[0].per_run: null must be true or false");
  EXPECT_EQ(ErrorOf(R"({"columns": {"x": null}})"),
            "1:19: columns.x: null must be an object, in braces { }");
  EXPECT_EQ(ErrorOf(R"({"model": {"equations": {"tables": {"f": {"x": null}}}}})"), "");
}

TEST(JsonStructure, IsCheckedBeforeATextIsRead) {
  v1::Problem problem;
  EXPECT_EQ(FromJson(R"({"fixed": {"m": 1}, "fixed": {}})", problem).message(),
            "line 1, column 21: fixed: given twice");
  EXPECT_EQ(FromJson("{\"fixed\": {\"kt\":" + std::string(100'000, '['), problem).message(),
            "line 1, column 115: brackets are nested more than 100 deep");
}

}  // namespace
}  // namespace polyest::internal
