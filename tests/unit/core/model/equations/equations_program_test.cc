// Checks that the graph shares common subexpressions, and that the program computes them once.

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "core/model/equations/definitions.h"
#include "core/model/equations/differentiate.h"
#include "core/model/equations/expressions.h"
#include "core/model/equations/program.h"

namespace polyest::internal::equations {
namespace {

// Compiles expressions of the variables a, b, c, d and of the time t.
class Shared {
 public:
  explicit Shared(const std::vector<std::string>& texts) {
    for (const char* name : {"a", "b", "c", "d"}) {
      names_[name] = graph_.Variable(static_cast<int>(places_.size()));
      places_.push_back({0, std::ssize(places_)});
    }
    names_["t"] = graph_.Variable(static_cast<int>(places_.size()));
    places_.push_back({VariablePlace::kTime, 0});
    for (const std::string& text : texts) {
      const auto syntax = Parse("text", text, {});
      EXPECT_TRUE(syntax.ok()) << syntax.status();
      roots_.push_back(*Lower(*syntax, names_, {}, graph_));
    }
  }

  NodeId root(size_t i) const { return roots_[i]; }
  Program Compile() const { return Program(graph_, roots_, places_, {}); }
  int Instructions() const { return Compile().instructions(); }

 private:
  Graph graph_{1000};
  std::map<std::string, NodeId> names_;
  std::vector<VariablePlace> places_;
  std::vector<NodeId> roots_;
};

TEST(EquationGraph, MakesOneNodeOfWhatMeansTheSame) {
  const char* const same[][2] = {{"a*b + c", "c + b*a"}, {"a - b", "a + -b"},
                                 {"-(a - b)", "b - a"},  {"a + 0", "a"},
                                 {"1*a", "a"},           {"a^2", "a*a"},
                                 {"a^3", "a*a*a"},       {"a/2", "0.5*a"},
                                 {"2*3*a", "6*a"},       {"2*(3*a)", "6*a"},
                                 {"-a*b", "-(a*b)"},     {"a/-b", "-(a/b)"},
                                 {"--a", "a"},           {"min(a, b)", "min(b, a)"},
                                 {"a > b", "b < a"},     {"a^0.5", "sqrt(a)"},
                                 {"1/a^2", "a^-2"},      {"a^0", "1"},
                                 {"0*a", "0"},           {"a - a", "0"},
                                 {"if(1, a, b)", "a"},   {"if(a, b, b)", "b"},
                                 {"2 + 3", "5"},         {"sin(0)", "0"},
                                 {"a/1", "a"},           {"0/a", "0"},
                                 {"-a - b", "-(a + b)"}};
  for (const auto& [left, right] : same) {
    const Shared both({left, right});
    EXPECT_EQ(both.root(0), both.root(1)) << left << " and " << right;
  }
}

TEST(EquationProgram, ComputesCommonSubexpressionsOnce) {
  // The instructions are a sum of two products, a sine and a quotient. The second expression adds
  // one.
  EXPECT_EQ(Shared({"sin(a*b + c*d)/d"}).Instructions(), 3);
  EXPECT_EQ(Shared({"sin(a*b + c*d)/d", "sin(d*c + b*a)/d + a"}).Instructions(), 4);
  EXPECT_EQ(Shared({"exp(a) + exp(a)*b + exp(a)*c"}).Instructions(), 2);
  // An expression asked for twice is copied.
  EXPECT_EQ(Shared({"exp(a)", "exp(a)"}).Instructions(), 2);
}

TEST(EquationProgram, DrawsAProductIntoTheSum) {
  EXPECT_EQ(Shared({"a*b + c"}).Instructions(), 1);
  EXPECT_EQ(Shared({"a*b - c"}).Instructions(), 1);
  EXPECT_EQ(Shared({"c - a*b"}).Instructions(), 1);
  EXPECT_EQ(Shared({"a*b + c", "a*b"}).Instructions(), 2);
}

// Compiles expressions of the states x, y, the parameters p, q and the time t.
Program OfParameters(const std::vector<std::string>& texts, bool keeps = true) {
  Graph graph(1000);
  std::map<std::string, NodeId> names;
  std::vector<VariablePlace> places;
  for (const char* name : {"x", "y", "p", "q"}) {
    names[name] = graph.Variable(static_cast<int>(places.size()));
    places.push_back({places.size() < 2 ? 0 : 1, std::ssize(places) % 2});
  }
  names["t"] = graph.Variable(static_cast<int>(places.size()));
  places.push_back({VariablePlace::kTime, 0});
  std::vector<NodeId> roots;
  for (const std::string& text : texts) {
    roots.push_back(*Lower(*Parse("text", text, {}), names, {}, graph));
  }
  return Program(graph, roots, places, {}, keeps ? 1 : Program::kNone);
}

constexpr int kInner = -1;  // the result of the inner operation

// Two operations, and the expression that means them.
struct TwoOperations {
  const char* text;
  Operation inner;
  std::array<int, 3> operands_of_inner;  // of a, b, c, d
  Operation outer;
  std::array<int, 3> operands_of_outer;  // as well, or kInner
};

std::vector<TwoOperations> KindsOfTwoOperations() {
  using enum Operation;
  constexpr int kNone = 0;
  return {
      {"a + b + c", kAdd, {0, 1, kNone}, kAdd, {kInner, 2, kNone}},
      {"a - b - c", kSubtract, {0, 1, kNone}, kSubtract, {kInner, 2, kNone}},
      {"c - (a + b)", kAdd, {0, 1, kNone}, kSubtract, {2, kInner, kNone}},
      {"c + (a*b - d)", kMultiplySubtract, {0, 1, 3}, kAdd, {2, kInner, kNone}},
      {"(d - a*b) - c", kSubtractMultiplied, {0, 1, 3}, kSubtract, {kInner, 2, kNone}},
      {"c - (a*b + d)", kMultiplyAdd, {0, 1, 3}, kSubtract, {2, kInner, kNone}},
      {"a*b*c", kMultiply, {0, 1, kNone}, kMultiply, {kInner, 2, kNone}},
      {"c*(a - b)", kSubtract, {0, 1, kNone}, kMultiply, {2, kInner, kNone}},
      {"c*(a*b + d)", kMultiplyAdd, {0, 1, 3}, kMultiply, {2, kInner, kNone}},
      {"c*(a - b) + d", kSubtract, {0, 1, kNone}, kMultiplyAdd, {2, kInner, 3}},
      {"(a + b)*c - d", kAdd, {0, 1, kNone}, kMultiplySubtract, {kInner, 2, 3}},
      {"d - (a - b)*c", kSubtract, {0, 1, kNone}, kSubtractMultiplied, {kInner, 2, 3}},
      {"c*d + a*b", kMultiply, {0, 1, kNone}, kMultiplyAdd, {2, 3, kInner}},
      {"a*b - c*d", kMultiply, {0, 1, kNone}, kSubtractMultiplied, {2, 3, kInner}},
      {"c*d - (a + b)", kAdd, {0, 1, kNone}, kMultiplySubtract, {2, 3, kInner}},
      {"(a*b + c)*d + a", kMultiplyAdd, {0, 1, 2}, kMultiplyAdd, {kInner, 3, 0}},
      {"a*b + c - d*a", kMultiplyAdd, {0, 1, 2}, kSubtractMultiplied, {3, 0, kInner}},
      {"(a - b) - c*d", kSubtract, {0, 1, kNone}, kSubtractMultiplied, {2, 3, kInner}},
  };
}

// The oracle is one operation after the other.
TEST(EquationProgram, ComputesTwoOperationsByOneInstruction) {
  const auto random = Eigen::ArrayXXd::Random(Program::kRows + kLanes, 4).eval();
  for (const TwoOperations& one : KindsOfTwoOperations()) {
    const Program program = Shared({one.text}).Compile();
    EXPECT_EQ(program.instructions(), 1) << one.text;
    Eigen::ArrayXXd results(random.rows(), 1);
    const ConstBlock block(random);
    const std::array<const ConstBlock*, 1> blocks = {&block};
    program.Run(0, blocks, results);
    for (Eigen::Index row = 0; row < random.rows(); ++row) {
      const auto& i = one.operands_of_inner;
      const double inner =
          EvaluateAtPoint(one.inner, random(row, i[0]), random(row, i[1]), random(row, i[2]));
      const auto value = [&](int operand) { return operand < 0 ? inner : random(row, operand); };
      const auto& o = one.operands_of_outer;
      EXPECT_EQ(results(row, 0), EvaluateAtPoint(one.outer, value(o[0]), value(o[1]), value(o[2])))
          << one.text;
    }
  }
}

// What others read, too, or is kept from run to run, has an instruction of its own.
TEST(EquationProgram, ComputesByItselfWhatIsReadAgain) {
  EXPECT_EQ(Shared({"(a - b)*c", "a - b"}).Instructions(), 2);
  EXPECT_EQ(Shared({"(a - b)*(a - b)"}).Instructions(), 2);
  EXPECT_EQ(OfParameters({"(p + q)*x"}).instructions(), 1);
  EXPECT_EQ(OfParameters({"(p + q)*x"}).instructions_of_parameters(), 1);
}

TEST(EquationProgram, ReusesRegistersThatAreNoLongerNeeded) {
  std::string sum = "a";
  for (int i = 0; i < 100; ++i) sum += " + sin(" + std::to_string(i + 1) + "*b)";
  const Program program = Shared({sum}).Compile();
  // The program has a hundred sines, half as many sums of three terms, and all products except that
  // with 1.
  EXPECT_EQ(program.instructions(), 249);
  EXPECT_LE(program.registers(), 4);
}

// The oracle is the same expression of a variable that has the time in every row: the same bits.
TEST(EquationProgram, ComputesWhatDependsOnTheTimeAloneOnceForAllRows) {
  const Program program =
      Shared({"2*sin(3*t) + a", "sin(3*t)", "exp(-t)*cos(t)", "a*sin(3*t) - t"}).Compile();
  // 3 t and its sine, −t, its exponential, the cosine and their product.
  EXPECT_EQ(program.instructions_of_time(), 6);
  // Two sums with products, and two copies into all rows.
  EXPECT_EQ(program.instructions(), 4);
  const Program of_rows =
      Shared({"2*sin(3*d) + a", "sin(3*d)", "exp(-d)*cos(d)", "a*sin(3*d) - d"}).Compile();
  EXPECT_EQ(of_rows.instructions_of_time(), 0);
  constexpr Eigen::Index kMany = Program::kRows + 2 * kLanes;
  Eigen::ArrayXXd variables(kMany, 4), results(kMany, 4), expected(kMany, 4);
  for (const double time_s : {0.0, 0.7, 12.3}) {
    variables.setRandom();
    variables.col(3) = time_s;
    const ConstBlock block(variables);
    const std::array<const ConstBlock*, 1> blocks = {&block};
    program.Run(time_s, blocks, results);
    of_rows.Run(0, blocks, expected);
    EXPECT_TRUE((results == expected).all());
  }
}

const std::vector<std::string> kOfParameters = {"x*(p + q)^2 + y/(p*q)", "y/(p*q) - x/q", "exp(p)",
                                                "p", "x + p*q"};

TEST(EquationProgram, SeparatesWhatDependsOnTheParametersAlone) {
  const Program program = OfParameters(kOfParameters);
  // p + q, its square, p q, exp(p) and the reciprocals of p q and q.
  EXPECT_EQ(program.instructions_of_parameters(), 6);
  // y/(p q), three sums, two of them with a product, and two copies.
  EXPECT_EQ(program.instructions(), 6);
  EXPECT_EQ(OfParameters(kOfParameters, false).instructions_of_parameters(), 0);
}

Eigen::ArrayXXd Evaluate(const Program& program, const Eigen::ArrayXXd& states,
                         const Eigen::ArrayXXd& parameters, double time_s = 0) {
  Eigen::ArrayXXd results(states.rows(), program.results());
  const ConstBlock of_states(states), of_parameters(parameters);
  const std::array<const ConstBlock*, 2> blocks = {&of_states, &of_parameters};
  program.Run(time_s, blocks, results);
  return results;
}

// A sum, difference or product of others, and its value in each row.
struct Expression {
  std::string text;
  Eigen::ArrayXd values;
};

// Returns expressions of those given, `count` on top of these; others may read each of them again.
std::vector<Expression> Combined(std::vector<Expression> expressions, int count,
                                 std::mt19937& random) {
  for (int i = 0; i < count; ++i) {
    const Expression& left = expressions[random() % expressions.size()];
    const Expression& right = expressions[random() % expressions.size()];
    const unsigned operation = random() % 3;
    // Products of large numbers would have to be rounded.
    const bool large = (left.values.abs().maxCoeff() * right.values.abs().maxCoeff()) > 1e12;
    const auto text = [&](const char* symbol) {
      return absl::StrCat("(", left.text, symbol, right.text, ")");
    };
    if (operation == 0 && !large) {
      expressions.push_back({text("*"), left.values * right.values});
    } else if (operation == 1) {
      expressions.push_back({text(" - "), left.values - right.values});
    } else {
      expressions.push_back({text(" + "), left.values + right.values});
    }
  }
  return expressions;
}

// The oracle is arithmetic of integers, which is exact.
TEST(EquationProgram, ComputesExpressionsOfIntegersExactly) {
  std::mt19937 random(1);
  constexpr Eigen::Index kMany = Program::kRows + kLanes;
  for (int i = 0; i < 300; ++i) {
    const auto integers = [&] {
      return Eigen::ArrayXXd(Eigen::ArrayXXd::NullaryExpr(
          kMany, 2, [&] { return static_cast<double>(random() % 7) - 3; }));
    };
    const Eigen::ArrayXXd states = integers(), parameters = integers();
    const double time_s = i % 5;
    std::vector<Expression> leaves = {{"x", states.col(0)},
                                      {"y", states.col(1)},
                                      {"p", parameters.col(0)},
                                      {"q", parameters.col(1)},
                                      {"t", Eigen::ArrayXd::Constant(kMany, time_s)},
                                      {"3", Eigen::ArrayXd::Constant(kMany, 3)}};
    const std::vector<Expression> all = Combined(leaves, 1 + i % 9, random);
    std::vector<std::string> texts;
    for (size_t one = leaves.size(); one < all.size(); ++one) texts.push_back(all[one].text);
    const std::vector<std::string> last = {texts.back()};
    for (const auto& asked : {texts, last}) {
      const Eigen::ArrayXXd results = Evaluate(OfParameters(asked), states, parameters, time_s);
      for (size_t one = 0; one < asked.size(); ++one) {
        const Expression& expected = all[all.size() - asked.size() + one];
        EXPECT_TRUE((results.col(static_cast<Eigen::Index>(one)) == expected.values).all())
            << expected.text;
      }
    }
  }
}

// The oracles are a program that has kept nothing yet, for the bits, and one that keeps nothing.
TEST(EquationProgram, ComputesWhatDependsOnTheParametersAgainWhereTheseChange) {
  const Program program = OfParameters(kOfParameters);
  const Program plain = OfParameters(kOfParameters, false);
  Eigen::ArrayXXd states(Program::kRows + 2 * kLanes, 2), parameters(states.rows(), 2);
  parameters.setConstant(1.5);
  for (int run = 0; run < 40; ++run) {
    states.setRandom();
    if (run % 3 == 0) parameters(run % (3 * kLanes), run % 2) += 0.1;
    if (run % 5 == 0) Evaluate(OfParameters({"x*sqrt(q)"}), states, parameters);
    if (run == 30) {
      states.conservativeResize(3 * kLanes, 2);
      parameters.conservativeResize(3 * kLanes, 2);
    }
    const Eigen::ArrayXXd results = Evaluate(program, states, parameters);
    const Program fresh = OfParameters(kOfParameters);
    EXPECT_TRUE((results == Evaluate(fresh, states, parameters)).all()) << run;
    // A reciprocal and a product round once more than a quotient, of terms of at most 10.
    EXPECT_LT((results - Evaluate(plain, states, parameters)).abs().maxCoeff(), 4e-15) << run;
  }
}

TEST(EquationProgram, ComputesConstantsVariablesAndZeros) {
  const Shared shared({"0", "2", "b", "b", "a + b"});
  const Program program = shared.Compile();
  Eigen::ArrayXXd variables(kLanes, 4), results(kLanes, 5);
  for (int i = 0; i < 4; ++i) variables.col(i).setConstant(i + 1);
  const ConstBlock block(variables);
  const std::array<const ConstBlock*, 1> blocks = {&block};
  program.Run(0, blocks, results);
  const Eigen::Array<double, 1, 5> expected(0, 2, 2, 2, 3);
  EXPECT_TRUE((results == expected.replicate(kLanes, 1)).all());
}

TEST(Expressions, TieParametersToOthers) {
  const auto expressions = Expressions::Make(
      "derived", {{"I", "m*r^2"}, {"I2", "2*I + k"}, {"k2", "k"}}, {"k", "m", "unused", "r"});
  ASSERT_TRUE(expressions.ok()) << expressions.status();
  EXPECT_EQ(expressions->names(), (std::vector<std::string>{"I", "I2", "k2"}));
  EXPECT_EQ(expressions->variables_used(), (std::set<std::string>{"k", "m", "r"}));
  for (const Eigen::Index rows : {0, 1, 7, 8, 9, 64, 100}) {
    const Matrix variables = Matrix::NullaryExpr(rows, 4, [](Eigen::Index i, Eigen::Index j) {
      return 1 + 0.5 * static_cast<double>(i) + static_cast<double>(j);
    });
    Matrix results(rows, 3);
    expressions->Evaluate(variables, results);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double inertia = variables(i, 1) * variables(i, 3) * variables(i, 3);
      EXPECT_NEAR(results(i, 0), inertia, 1e-15 * inertia);
      EXPECT_NEAR(results(i, 1), 2 * inertia + variables(i, 0), 1e-15 * inertia * 4);
      EXPECT_EQ(results(i, 2), variables(i, 0));
    }
  }
}

TEST(Expressions, MayBeNone) {
  const auto expressions = Expressions::Make("derived", {}, {"k"});
  ASSERT_TRUE(expressions.ok()) << expressions.status();
  Matrix results(3, 0);
  expressions->Evaluate(Matrix::Ones(3, 1), results);
  EXPECT_TRUE(expressions->variables_used().empty());
}

}  // namespace
}  // namespace polyest::internal::equations
