// Tests what models say of their own structure: whether they use the time, and whether they are
// linear in states and inputs.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "polyest/catalogue.h"
#include "tests/unit/core/model/equations/equations.h"

namespace polyest::internal {
namespace {

// Makes x' = the text, with the states x and y, the parameters a, b and zero, and the inputs u and
// fixed.
std::shared_ptr<const StateSpaceModel> ModelOf(const std::string& text) {
  return MakeOrFail({.states = {{"x", text}, {"y", "-y"}},
                     .outputs = {{"x", "exp(x)*t"}},
                     .parameters = {{"a", 1}, {"b", 2}, {"zero", 0}},
                     .inputs = {"u", "fixed"},
                     .tables = {{"table", {.x = {0, 1}, .value = {1, 2}}}}});
}

bool IsLinear(const std::string& text) {
  const auto model = ModelOf(text);
  std::vector<bool> zero(model->description().parameters.size(), false);
  zero[static_cast<size_t>(*model->description().FindParameter("zero"))] = true;
  return model->IsLinear(zero, {false, true});
}

TEST(EquationStructure, RecognizesWhatIsLinearInStatesAndInputs) {
  for (const char* text :
       {"a*x - b*y + u", "0", "a", "-(a*x + y)/b", "sqrt(a)*x + exp(b)*u + sin(a*b)",
        "a*(x - b*(y + u))/(a + b)", "if(a > b, x, 2*y) + u", "x/2 - 3", "fixed*x + sin(fixed)",
        "zero*x^3 + y", "zero*sin(t*x) - x", "x*a^2.5", "table(a)*x", "max(a, b)*y - min(a, 1)*x",
        "x - x^3*zero*y/a", "pi*x"}) {
    EXPECT_TRUE(IsLinear(text)) << text;
  }
}

TEST(EquationStructure, TakesNothingElseForLinear) {
  for (const char* text : {"x^2",
                           "x*y",
                           "u*x",
                           "a/x",
                           "sin(x)",
                           "t",
                           "a*t",
                           "x*t",
                           "abs(x)",
                           "if(x > 0, x, y)",
                           "if(u > 0, 1, 2)",
                           "min(x, y)",
                           "max(a, x)",
                           "sign(y)",
                           "table(x)",
                           "hypot(x, y)",
                           "x/y",
                           "u^2",
                           "sin(u)",
                           "exp(t)*x",
                           "a*x*x",
                           "sqrt(x^2)",
                           "a^x",
                           "zero/x",
                           "x/u",
                           "floor(x)",
                           "x && y",
                           "!x",
                           "x == y",
                           "mod(x, a)"}) {
    EXPECT_FALSE(IsLinear(text)) << text;
  }
}

TEST(EquationStructure, KnowsWhetherTheRightHandSidesUseTheTime) {
  EXPECT_FALSE(ModelOf("a*x")->uses_time());  // The output does.
  EXPECT_TRUE(ModelOf("a*x + b*sin(t)")->uses_time());
  EXPECT_TRUE(ModelOf("if(t > 1, x, y)")->uses_time());
}

// Expects f(s z) − f(0) = s (f(z) − f(0)) and f(z + z') − f(0) = f(z) + f(z') − 2 f(0) for random
// states and inputs z, at parameters that are 0 where `zero` says so.
bool IsSuperposable(const StateSpaceModel& model, const std::vector<bool>& zero) {
  const ModelDescription& description = model.description();
  const auto columns = [](const auto& list) { return static_cast<Eigen::Index>(list.size()); };
  Eigen::ArrayXXd parameters = Varied(kLanes, columns(description.parameters), 1.5).abs() + 0.5;
  for (size_t j = 0; j < zero.size(); ++j) {
    if (zero[j]) parameters.col(static_cast<Eigen::Index>(j)).setZero();
  }
  const auto f = [&](double s, double t) {
    const Eigen::ArrayXXd states = s * Varied(kLanes, columns(description.states), 0.3) +
                                   t * Varied(kLanes, columns(description.states), 2.1);
    const Eigen::ArrayXXd inputs = s * Varied(kLanes, columns(description.inputs), 0.9) +
                                   t * Varied(kLanes, columns(description.inputs), 2.8);
    Eigen::ArrayXXd derivatives(kLanes, states.cols());
    model.Derivatives(0.7, states, parameters, inputs, derivatives);
    return derivatives;
  };
  const Eigen::ArrayXXd zero_state = f(0, 0);
  const auto agree = [](const Eigen::ArrayXXd& a, const Eigen::ArrayXXd& b) {
    return ((a - b).abs() <= 1e-12 * (1 + a.abs().maxCoeff())).all();
  };
  return agree(f(3, 0) - zero_state, 3 * (f(1, 0) - zero_state)) &&
         agree(f(1, 1) - zero_state, f(1, 0) + f(0, 1) - 2 * zero_state);
}

TEST(BuiltinStructure, DeclaresLinearExactlyWhatIs) {
  int linear = 0;
  for (const auto& model : BuiltinModels()) {
    const ModelDescription& description = model->description();
    if (description.states.empty()) continue;
    EXPECT_FALSE(model->uses_time()) << description.name;
    const std::vector<bool> constant(description.inputs.size(), false);
    const std::vector<bool> none(description.parameters.size(), false);
    EXPECT_EQ(model->IsLinear(none, constant), IsSuperposable(*model, none)) << description.name;
    for (size_t j = 0; j < none.size(); ++j) {
      std::vector<bool> zero = none;
      zero[j] = true;
      if (!model->IsLinear(zero, constant)) continue;
      ++linear;
      // Divisors that are 0 make everything NaN, which no superposition holds for.
      if (!model->IsLinear(none, constant)) {
        EXPECT_TRUE(IsSuperposable(*model, zero)) << description.name;
      }
    }
    if (description.name == "duffing" || description.name == "roll_plane_4dof") {
      std::vector<bool> zero = none;
      for (const char* name : {"k2", "k3", "c_f"}) {
        if (const auto j = description.FindParameter(name)) zero[static_cast<size_t>(*j)] = true;
      }
      EXPECT_TRUE(model->IsLinear(zero, constant));
      EXPECT_TRUE(IsSuperposable(*model, zero));
    }
  }
  EXPECT_GT(linear, 0);
}

}  // namespace
}  // namespace polyest::internal
