#include "proto/wire/json/json_structure.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "polyest/v1/problem.pb.h"
#include "proto/wire/json/json_format.h"

namespace polyest::internal {
namespace {

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
  EXPECT_EQ(ErrorOf("{\"a\": 1,\n }"), "1:8: no comma may follow the last value");
  EXPECT_EQ(ErrorOf("[1, [2, ], 3]"), "1:7: no comma may follow the last value");
  EXPECT_EQ(ErrorOf("{'a': 1}"), "1:2: names and texts stand in double quotes, not in single ones");
  EXPECT_EQ(ErrorOf("{\"a\":\n  'x'}"),
            "2:3: names and texts stand in double quotes, not in single ones");
  EXPECT_EQ(ErrorOf("{a: 1}"), "1:2: the name a must stand in double quotes");
  EXPECT_EQ(ErrorOf("{\"a\": 1, 5: 2}"), "1:10: the name 5 must stand in double quotes");
  for (const char* const comment : {"// x", "/* x */", "# x"}) {
    EXPECT_EQ(ErrorOf(std::string("{\"a\": 1} ") + comment), "1:10: JSON has no comments");
  }
  EXPECT_EQ(ErrorOf("{\"a\": 1}\v"),
            "1:9: nothing may follow the end of the JSON text, but \\x0b does");
}

TEST(JsonStructure, RefusesOtherNumbers) {
  for (const char* const number :
       {"+1", ".5", "1.", "007", "0x10", "1e", "1e+", "-", "1_000", "--1", "1.5.2", "-Infinity"}) {
    EXPECT_EQ(ErrorOf(absl::StrCat("[", number, "]")),
              absl::StrCat("1:2: ", number, " is no number of JSON"));
  }
  EXPECT_EQ(ErrorOf("[1e400]"), "1:2: 1e400 is beyond the range of a number");
  EXPECT_EQ(ErrorOf("[1" + std::string(400, '0') + "]"),
            "1:2: 1" + std::string(59, '0') + "… is beyond the range of a number");
}

TEST(JsonStructure, SaysWhatMustStandWhereAnotherThingStands) {
  EXPECT_EQ(ErrorOf("{\"a\" 1}"), "1:6: a colon must follow the name \"a\", not 1");
  EXPECT_EQ(ErrorOf("{\"a\": 1\n \"b\": 2}"), "2:2: a comma or } must stand before \"b\"");
  EXPECT_EQ(ErrorOf("[1 2]"), "1:4: a comma or ] must stand before 2");
  EXPECT_EQ(ErrorOf("[1}"), "1:3: a comma or ] must stand before }");
  EXPECT_EQ(ErrorOf("{,}"), "1:2: a name in double quotes must stand here, not ,");
  EXPECT_EQ(ErrorOf("{[]: 1}"), "1:2: a name in double quotes must stand here, not [");
  EXPECT_EQ(ErrorOf("{\"a\": 1 \"b: 2}"), "1:9: a comma or } must stand before \"");
  EXPECT_EQ(ErrorOf("{\"a\": }"), "1:7: a value must stand here, not }");
  EXPECT_EQ(ErrorOf("{:1}"), "1:2: a name in double quotes must stand here, not :");
  EXPECT_EQ(ErrorOf("[,]"), "1:2: a value must stand here, not ,");
  EXPECT_EQ(ErrorOf("]"), "1:1: a value must stand here, not ]");
  EXPECT_EQ(ErrorOf("{}}"), "1:3: nothing may follow the end of the JSON text, but } does");
  EXPECT_EQ(ErrorOf("{}{}"), "1:3: nothing may follow the end of the JSON text, but { does");
  for (const char* const word : {"NaN", "Infinity", "nonsense", "True", "\u201cx\u201d"}) {
    EXPECT_EQ(ErrorOf(word),
              absl::StrCat("1:1: ", word,
                           " is no value of JSON, which has numbers, true, false, null, texts in "
                           "double quotes, [ ] and { }"));
  }
}

TEST(JsonStructure, NamesTheBracketThatIsNotClosed) {
  EXPECT_EQ(ErrorOf(""), "1:1: a JSON object must stand here");
  EXPECT_EQ(ErrorOf("{\n \"a\": [1,\n"),
            "3:1: the text ends before the [ of line 2, column 7 is closed");
  EXPECT_EQ(ErrorOf("{\"a\""), "1:5: the text ends before the { of line 1, column 1 is closed");
}

TEST(JsonStructure, RefusesTextsThatAreNotWhole) {
  EXPECT_EQ(ErrorOf("{\"a"), "1:2: the text that begins here has no closing quote on its line");
  EXPECT_EQ(ErrorOf("[\"\\"), "1:3: \\ is no escape of JSON; a backslash is written \\\\");
  EXPECT_EQ(ErrorOf("[\"\\\n"), "1:3: \\\\n is no escape of JSON; a backslash is written \\\\");
  EXPECT_EQ(ErrorOf("[\"\\\xff"), "1:3: \\? is no escape of JSON; a backslash is written \\\\");
  EXPECT_EQ(ErrorOf("{\"a\": \"b\n}"),
            "1:7: the text that begins here has no closing quote on its line");
  EXPECT_EQ(ErrorOf("[\"a\tb\"]"), "1:4: the control character U+0009 must be written \\u0009");
  EXPECT_EQ(ErrorOf(R"(["C:\rig"])"), "");
  EXPECT_EQ(ErrorOf(R"(["C:\data"])"),
            "1:5: \\d is no escape of JSON; a backslash is written \\\\");
  EXPECT_EQ(ErrorOf(R"(["\u12g4"])"), "1:3: four hexadecimal digits must follow \\u");
  EXPECT_EQ(ErrorOf(R"(["\ud83d"])"), "1:3: \\ud83d is one half of a character without the other");
  EXPECT_EQ(ErrorOf(R"(["\udE00"])"), "1:3: \\ude00 is one half of a character without the other");
  EXPECT_EQ(ErrorOf("[\"Gr\xf6\xdf"
                    "e\"]"),
            "1:5: the byte 0xF6 is no UTF-8, in which JSON is written");
}

TEST(JsonStructure, CountsColumnsInCharacters) {
  EXPECT_EQ(ErrorOf("{\"\u00b5\": 1,}"), "1:8: no comma may follow the last value");
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
  EXPECT_EQ(ErrorOf(R"({"a:b": 1, "a": ":a", "b": "a:"})"), "");
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
