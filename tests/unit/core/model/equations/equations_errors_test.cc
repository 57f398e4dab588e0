// Tests every message that the equations of a user can cause, and the limits.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/model/equations/expressions.h"
#include "core/model/equations/limits.h"
#include "tests/unit/core/model/equations/equations.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

// Returns the only message about an output y with that text.
std::string ErrorOf(const std::string& text) {
  const auto messages =
      Messages({.outputs = {{"y", text}}, .tables = {{"f", {{0, 1}, {}, {0, 1}}}}});
  EXPECT_THAT(messages, SizeIs(1)) << text;
  return messages.empty() ? "" : messages.front();
}

struct Wrong {
  const char* text;
  const char* message;  // follows "model.equations.outputs.y: "
};

const Wrong kWrong[] = {
    {"", "column 1: expected an expression (at the end)"},
    {"   ", "column 4: expected an expression (at the end)"},
    {"k * x +", "column 8: expected a number, a name or ( (at the end)"},
    {"k * * x", "column 5: expected a number, a name or ( (at \"* x\")"},
    {"(a + b", "column 7: expected ) for the ( in column 1 (at the end)"},
    {"a + b)", "column 6: a ) without its ( (at \")\")"},
    {"sin(a, ", "column 8: expected a number, a name or ( (at the end)"},
    {"min(a b)", "column 7: expected , or ) for the ( in column 4 (at \"b)\")"},
    {"a b", "column 3: expected an operator; products are written with * (at \"b\")"},
    {"2x", "column 1: not a number; products are written with *, numbers like 1.5e-3 (at \"2x\")"},
    {"1.2.3",
     "column 1: not a number; products are written with *, numbers like 1.5e-3 (at \"1.2.3\")"},
    {"a + 1e999",
     "column 5: a number out of range; its size must be between 1e-307 and 1e308 (at \"1e999\")"},
    {"a = b", "column 3: a lone =; equality is == (at \"= b\")"},
    {"a & b", "column 3: a lone &; \"and\" is && (at \"& b\")"},
    {"a | b", "column 3: a lone |; \"or\" is ||, the absolute value abs(x) (at \"| b\")"},
    {"a % b", "column 3: unexpected %; the remainder is mod(a, b) (at \"% b\")"},
    {"a ** b", "column 3: unexpected **; powers are written x^2 (at \"** b\")"},
    {"[a]", "column 1: unexpected bracket; only ( ) group (at \"[a]\")"},
    {"a ; b", "column 3: unexpected character (at \"; b\")"},
    {"k·x", "column 2: unexpected character (at \"·x\")"},
    {"αβ*x", "column 1: unexpected character (at \"αβ*x\")"},
    {"a + 'b'", "column 5: unexpected character (at \"'b'\")"},
    {"a < b < c", "column 7: comparisons do not chain: a < b < c is a < b && b < c (at \"< c\")"},
    {"k*sine(a)", "column 3: unknown function \"sine\"; did you mean \"sin\"? (at \"sine(a)\")"},
    {"Sqrt(a)", "column 1: unknown function \"Sqrt\"; did you mean \"sqrt\"? (at \"Sqrt(a)\")"},
    {"wobble(a)",
     "column 1: unknown function \"wobble\"; the functions are abs, acos, asin, atan, atan2, ceil, "
     "cos, cosh, exp, floor, hypot, if, log, log10, max, min, mod, pow, sign, sin, sinh, sqrt, "
     "tan, tanh, f (at \"wobble(a)\")"},
    {"sin", "column 1: sin is a function; it is called as sin(…) (at \"sin\")"},
    {"f + 1", "column 1: f is a table; it is called as f(…) (at \"f + 1\")"},
    {"f(a, b)", "column 1: the table f takes 1 argument, not 2 (at \"f(a, b)\")"},
    {"1 + sin()", "column 5: sin takes 1 argument, not 0 (at \"sin()\")"},
    {"sin(a, b)", "column 1: sin takes 1 argument, not 2 (at \"sin(a, b)\")"},
    {"atan2(a)", "column 1: atan2 takes 2 arguments, not 1 (at \"atan2(a)\")"},
    {"min(a)", "column 1: min takes 2 to 100 arguments, not 1 (at \"min(a)\")"},
    {"if(a, b)", "column 1: if takes 3 arguments, not 2 (at \"if(a, b)\")"},
    {"a + 1/0", "column 6: the value here is not finite (at \"/0\")"},
    {"sqrt(-1)*a", "column 1: the value here is not finite (at \"sqrt(-1)*a\")"},
    {"a*10^400", "column 5: the value here is not finite (at \"^400\")"},
    {"1e300*1e300", "column 6: the value here is not finite (at \"*1e300\")"},
    {"a + this_is_a_long_expression(b)*2",
     "column 5: unknown function \"this_is_a_long_expressio…\"; the functions are abs, acos, asin, "
     "atan, atan2, ceil, cos, cosh, exp, floor, hypot, if, log, log10, max, min, mod, pow, sign, "
     "sin, sinh, sqrt, tan, tanh, f (at \"this_is_a_long_expressio…\")"},
};

TEST(EquationErrors, PointAtTheCharacterAndSayWhatWasExpected) {
  for (const Wrong& wrong : kWrong) {
    EXPECT_EQ(ErrorOf(wrong.text), std::string("model.equations.outputs.y: ") + wrong.message);
  }
}

TEST(EquationErrors, QuoteBytesThatAreNoTextAsEscapes) {
  EXPECT_EQ(ErrorOf("a + \xff\x01"),
            "model.equations.outputs.y: column 5: unexpected character (at \"\\xff\\x01\")");
  EXPECT_EQ(ErrorOf(std::string("a\0b", 3)),
            "model.equations.outputs.y: column 2: unexpected character (at \"\\x00\\x62\")");
}

TEST(EquationErrors, NameEveryProblemAtOnce) {
  const EquationSpecification equations = {.states = {{"x", "v +"}, {"v", "sine(x)"}},
                                           .outputs = {{"y", "1/0"}, {"z", "(x"}}};
  EXPECT_THAT(Messages(equations),
              ElementsAre(StartsWith("model.equations.states.v: column 1: unknown function"),
                          StartsWith("model.equations.states.x: column 4: expected a number"),
                          StartsWith("model.equations.outputs.z: column 3: expected )")));
  const auto model = MakeEquationModel(equations);
  EXPECT_EQ(model.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(model.status().message(), Messages(equations).front());
}

std::string OnlyErrorOf(const EquationSpecification& equations) {
  const auto messages = Messages(equations);
  EXPECT_THAT(messages, SizeIs(1));
  return messages.empty() ? "" : messages.front();
}

TEST(EquationErrors, RefuseNamesThatMeanTwoThings) {
  EXPECT_EQ(OnlyErrorOf({.states = {{"x", "1"}}, .outputs = {{"y", "x"}}, .inputs = {"x"}}),
            "model.equations.inputs[0]: x is a state already");
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"y", "u"}}, .inputs = {"u", "u"}}),
            "model.equations.inputs[1]: u is an input already");
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"y", "a"}}, .intermediates = {{"a", "1"}}, .inputs = {"a"}}),
            "model.equations.intermediates.a: a is an input already");
  EXPECT_EQ(
      OnlyErrorOf({.states = {{"x", "1"}}, .outputs = {{"y", "x"}}, .parameters = {{"x", 1}}}),
      "model.equations.parameters.x: x is a state already");
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"u", "2*u"}}, .inputs = {"u"}}),
            "model.equations.outputs.u: u is an input already");
  EXPECT_EQ(OnlyErrorOf({.states = {{"x", "1"}, {"x_0", "1"}}, .outputs = {{"y", "x"}}}),
            "model.equations.states.x: its initial value is named x_0, which is a state");
  EXPECT_EQ(
      OnlyErrorOf(
          {.outputs = {{"y", "1"}}, .inputs = {"f"}, .tables = {{"f", {{0, 1}, {}, {0, 1}}}}}),
      "model.equations.tables.f: f is an input already");
}

TEST(EquationErrors, RefuseNamesThatAreNone) {
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"t", "1"}}}),
            "model.equations.outputs.t: t means something else in an expression: t, pi and the "
            "names of functions are reserved");
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"y", "1"}}, .parameters = {{"sin", 1}}}),
            "model.equations.parameters.sin: sin means something else in an expression: t, pi and "
            "the names of functions are reserved");
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"a b", "1"}}}),
            "model.equations.outputs: \"a b\" is not a name: a letter, then letters, digits and _, "
            "at most 64 of them");
  EXPECT_THAT(OnlyErrorOf({.outputs = {{"", "1"}}}), HasSubstr("\"\" is not a name"));
  EXPECT_THAT(OnlyErrorOf({.outputs = {{"2x", "1"}}}), HasSubstr("is not a name"));
  EXPECT_THAT(OnlyErrorOf({.outputs = {{std::string(65, 'a'), "1"}}}), HasSubstr("is not a name"));
}

TEST(EquationErrors, RefuseWhatDependsOnItself) {
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"y", "a"}},
                         .intermediates = {{"a", "b + 1"}, {"b", "2*c"}, {"c", "a"}}}),
            "model.equations.intermediates.a: depends on itself: a → b → c → a");
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"y", "1"}}, .intermediates = {{"a", "a"}}}),
            "model.equations.intermediates.a: depends on itself: a → a");
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"y", "z + 1"}, {"z", "k"}}}),
            "model.equations.outputs.y: column 1: z is an output; what others use is an "
            "intermediate (at \"z + 1\")");
}

TEST(EquationErrors, RefuseAModelWithoutOutputs) {
  EXPECT_EQ(OnlyErrorOf({.states = {{"x", "1"}}}),
            "model.equations.outputs: there must be at least one");
}

TEST(EquationErrors, RefuseDefaultsThatAreNotFinite) {
  EXPECT_EQ(OnlyErrorOf({.outputs = {{"y", "k"}},
                         .parameters = {{"k", std::numeric_limits<double>::infinity()}}}),
            "model.equations.parameters.k: is inf; it must be finite");
}

TEST(EquationErrors, RefuseTablesThatAreNone) {
  const auto error = [](const LookupTable& table) {
    return OnlyErrorOf({.outputs = {{"y", "1"}}, .tables = {{"f", table}}});
  };
  EXPECT_EQ(error({{0}, {}, {1}}),
            "model.equations.tables.f.x: has 1 values; it must have at least 2");
  EXPECT_EQ(error({{0, 1, 1}, {}, {1, 2, 3}}),
            "model.equations.tables.f.x[2]: is 1 after 1; the values must strictly increase");
  EXPECT_EQ(error({{0, 1}, {0}, {1, 2}}),
            "model.equations.tables.f.y: has 1 values; it must have at least 2");
  EXPECT_EQ(error({{0, 1}, {}, {1, 2, 3}}),
            "model.equations.tables.f.value: has 3 values; 2 are needed, one for each x");
  EXPECT_EQ(error({{0, 1}, {0, 1}, {1, 2, 3}}),
            "model.equations.tables.f.value: has 3 values; 2 × 2 are needed, one for each pair of "
            "x and y, all of the first x first");
  EXPECT_EQ(error({{0, NAN}, {}, {1, 2}}),
            "model.equations.tables.f.x[1]: is nan; it must be finite");
  EXPECT_EQ(error({{0, 1}, {}, {1, INFINITY}}),
            "model.equations.tables.f.value[1]: is inf; it must be finite");
}

absl::Status StatusOf(const EquationSpecification& equations) {
  return MakeEquationModel(equations).status();
}

EquationSpecification Output(std::string text) { return {.outputs = {{"y", std::move(text)}}}; }

std::string Repeated(const std::string& part, int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += part;
  return text;
}

TEST(EquationLimits, BoundTheNesting) {
  using equations::kMaxNesting;
  for (const char* opening : {"(", "-", "sin(", "2^"}) {
    const bool closes = std::string(opening).ends_with("(");
    const auto nested = [&](int depth) {
      return Repeated(opening, depth) + "a" + (closes ? Repeated(")", depth) : "");
    };
    EXPECT_TRUE(StatusOf(Output(nested(kMaxNesting - 1))).ok()) << opening;
    EXPECT_THAT(StatusOf(Output(nested(kMaxNesting))).message(),
                HasSubstr("nested more than 100 deep; use intermediates"))
        << opening;
  }
}

TEST(EquationLimits, BoundTheTextOfOneExpressionAndOfAll) {
  using namespace equations;
  const std::string longest = "a" + std::string(kMaxTextLength - 1, ' ');
  EXPECT_TRUE(StatusOf(Output(longest)).ok());
  EXPECT_EQ(StatusOf(Output(longest + " ")).code(), absl::StatusCode::kResourceExhausted);
  EquationSpecification many;
  for (size_t i = 0; i < kMaxTextInAll / kMaxTextLength; ++i) {
    many.outputs["y" + std::to_string(i)] = longest;
  }
  EXPECT_TRUE(StatusOf(many).ok());
  many.outputs["z"] = "1";
  EXPECT_EQ(StatusOf(many).code(), absl::StatusCode::kResourceExhausted);
}

TEST(EquationLimits, BoundTheNumbersOfEverything) {
  using namespace equations;
  EquationSpecification states = Output("1"), outputs, parameters = Output("1"),
                        inputs = Output("1");
  for (size_t i = 0; i <= kMaxStates; ++i) states.states["x" + std::to_string(i)] = "1";
  for (size_t i = 0; i <= kMaxExpressions; ++i) outputs.outputs["y" + std::to_string(i)] = "1";
  for (size_t i = 0; i <= kMaxNames; ++i) {
    parameters.parameters["k" + std::to_string(i)] = 1;
    inputs.inputs.push_back("u" + std::to_string(i));
  }
  EquationSpecification table = Output("1");
  table.tables["f"] = {std::vector<double>(kMaxTableValues + 1), {}, {}};
  for (const auto& [equations, message] :
       {std::pair(states, "model.equations.states: there are 101; at most 100 are allowed"),
        std::pair(outputs, "model.equations: there are 1001; at most 1000 are allowed"),
        std::pair(parameters,
                  "model.equations.parameters: there are 2001; at most 2000 are allowed"),
        std::pair(inputs, "model.equations.inputs: there are 2001; at most 2000 are allowed"),
        std::pair(
            table,
            "model.equations.tables.f: there are 100001 values; at most 100000 are allowed")}) {
    EXPECT_EQ(StatusOf(equations).code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(StatusOf(equations).message(), message);
  }
}

// The chain of intermediates would have exponential size if it were written out.
TEST(EquationLimits, LetSharedExpressionsGrowLinearly) {
  EquationSpecification equations = Output("a99");
  equations.intermediates["a0"] = "x + 1";
  for (int i = 1; i < 100; ++i) {
    const std::string last = "a" + std::to_string(i - 1);
    equations.intermediates["a" + std::to_string(i)] = last + "*sin(" + last + ") + " + last;
  }
  EXPECT_TRUE(StatusOf(equations).ok());
}

// Each text has a thousand products of different constants, their sums and the constants.
TEST(EquationLimits, BoundTheDistinctOperations) {
  EquationSpecification equations;
  for (int i = 0; i < 10; ++i) {
    std::string text = "a";
    for (int j = 0; j < 1000; ++j) text += "+" + std::to_string(1000 * i + j + 2) + "*a";
    equations.outputs["y" + std::to_string(i)] = text;
    if (i < 6) {
      EXPECT_TRUE(StatusOf(equations).ok());
    }
  }
  EXPECT_EQ(StatusOf(equations).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(StatusOf(equations).message(), HasSubstr("20000 different operations"));
}

// The equations need values again after all have been computed, 600 for each pair of outputs.
TEST(EquationLimits, BoundTheValuesAtOnce) {
  EquationSpecification equations;
  const auto add = [&equations](int outputs) {
    for (int i = 0; i < outputs; ++i) {
      std::string sum = "a", difference = "a";
      for (int j = 0; j < 200; ++j) {
        for (const char* function : {"sin(", "cos(", "tan("}) {
          const std::string value = function + std::to_string(200 * i + j) + "*a)";
          sum += "+" + value;
          difference += "-" + value;
        }
      }
      equations.outputs["sum" + std::to_string(i)] = sum;
      equations.outputs["difference" + std::to_string(i)] = difference;
    }
  };
  add(6);
  EXPECT_TRUE(StatusOf(equations).ok());
  equations.outputs.clear();
  add(7);
  EXPECT_EQ(StatusOf(equations).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(StatusOf(equations).message(), HasSubstr("values at once; at most 4096"));
}

TEST(ExpressionErrors, BeginWithTheFieldGiven) {
  const auto error = [](const std::map<std::string, std::string>& definitions) {
    return std::string(Expressions::Make("derived", definitions, {"k1", "m"}).status().message());
  };
  EXPECT_EQ(error({{"k2", "2*k3"}}),
            "derived.k2: column 3: unknown name \"k3\"; the names are k1, m (at \"k3\")");
  EXPECT_EQ(error({{"k2", "k1 +"}}),
            "derived.k2: column 5: expected a number, a name or ( (at the end)");
  EXPECT_EQ(error({{"k2", "t"}}),
            "derived.k2: column 1: unknown name \"t\"; the names are k1, m (at \"t\")");
  EXPECT_EQ(error({{"m", "1"}}), "derived.m: m is a variable already");
  EXPECT_EQ(error({{"pi", "1"}}), "derived.pi: pi is reserved in expressions");
  EXPECT_EQ(error({{"a.", "1"}}), "derived: \"a.\" is not a name");
  EXPECT_EQ(error({{"a", "b"}, {"b", "a"}}), "derived.a: depends on itself: a → b → a");
  EXPECT_EQ(error({{"a", "1/0"}}), "derived.a: column 2: the value here is not finite (at \"/0\")");
}

}  // namespace
}  // namespace polyest::internal
