// Tests the programs with frozen modes. The oracle is the model's own right-hand side, which
// follows the states.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/model/switching_model.h"
#include "tests/unit/core/model/equations/equations.h"

namespace polyest::internal {
namespace {

// A model ẋ = y, ẏ = `text` with parameters p and q and an input u, whose output is `text` as well.
class Switching {
 public:
  explicit Switching(const std::string& text)
      : model_(MakeOrFail({.states = {{"x", "y"}, {"y", text}},
                           .outputs = {{"z", text}},
                           .parameters = {{"p", 0.3}, {"q", 0.7}},
                           .inputs = {"u"}})),
        switching_(dynamic_cast<const SwitchingModel*>(model_.get())) {
    states = 3 * Varied(kRows, 2, 0.3);
    parameters = Varied(kRows, std::ssize(model_->description().parameters), 1.1);
    inputs = Varied(kRows, 1, 2.9);
    modes = Eigen::ArrayXXd::Ones(kRows, 1 + Number());
    modes.col(0).setConstant(kTime);
  }

  Eigen::Index Number() const { return std::ssize(switching_->switches()); }
  Eigen::ArrayXXd Arguments() const {
    return Of(Number(),
              [&](const SwitchingPoint& at, Block result) { switching_->Arguments(at, result); });
  }
  // Sets the modes by the arguments, from the inner to the outer ones.
  void TakeNaturalModes() {
    for (Eigen::Index pass = 0; pass <= Number(); ++pass) {
      const Eigen::ArrayXXd a = Arguments();
      for (Eigen::Index i = 0; i < Number(); ++i) {
        const bool floor = switching_->switches()[static_cast<size_t>(i)] == SwitchKind::kFloor;
        for (Eigen::Index row = 0; row < kRows; ++row) {
          modes(row, 1 + i) = floor ? std::floor(a(row, i)) : a(row, i) > 0 ? 1 : -1;
        }
      }
    }
  }
  Eigen::ArrayXXd Frozen() const {
    return Of(2, [&](const SwitchingPoint& at, Block result) {
      switching_->FrozenDerivatives(at, result);
    });
  }
  Eigen::ArrayXXd FrozenOutput() const {
    return Of(
        1, [&](const SwitchingPoint& at, Block result) { switching_->FrozenOutputs(at, result); });
  }
  Eigen::ArrayXXd Natural() const {
    return Of(2, [&](const SwitchingPoint& at, Block result) {
      model_->Derivatives(kTime, at.states, at.parameters, at.inputs, result);
    });
  }
  Eigen::ArrayXXd Slopes() const {
    return Of(4 * Number(), [&](const SwitchingPoint& at, Block result) {
      switching_->ArgumentSlopes(at, result);
    });
  }

  static constexpr Eigen::Index kRows = 16;
  static constexpr double kTime = 1.25;
  Eigen::ArrayXXd modes, states, parameters, inputs;

 private:
  template <class Function>
  Eigen::ArrayXXd Of(Eigen::Index columns, const Function& function) const {
    const ConstBlock at_modes = modes, x = states, theta = parameters, u = inputs;
    Eigen::ArrayXXd result = Eigen::ArrayXXd::Constant(kRows, columns, 99);
    function(SwitchingPoint{at_modes, x, theta, u}, Block(result));
    return result;
  }

  std::shared_ptr<const StateSpaceModel> model_;
  const SwitchingModel* switching_;
};

TEST(EquationSwitches, FrozenPiecesAreThoseOfTheStates) {
  for (const char* text :
       {"p*sign(y)", "abs(x - y)", "min(x, y, u)", "max(x, p) - min(q, t*y)",
        "if(x > 0 && !(y <= u), x^2, y)", "if(x < p || y >= q, 1, 2)", "floor(2*x) + ceil(y)",
        "mod(x, 0.7) + mod(t, p)", "sign(if(x > 0, y, u))*abs(x)", "sign(abs(x) - 1)*x",
        "if(-2*x > 3*y, 1, sign(y - x))", "max(0, -x) + abs(3*x)"}) {
    Switching equations(text);
    ASSERT_GT(equations.Number(), 0) << text;
    equations.TakeNaturalModes();
    const Eigen::ArrayXXd natural = equations.Natural();
    EXPECT_LT((equations.Frozen() - natural).abs().maxCoeff(), 1e-14) << text;
    EXPECT_LT((equations.FrozenOutput().col(0) - natural.col(1)).abs().maxCoeff(), 1e-14) << text;
  }
}

TEST(EquationSwitches, FrozenPiecesGoOnWhereTheStatesLeaveThem) {
  Switching spring("-if(x > 0, p*x, q*x) - sign(y)");
  ASSERT_EQ(spring.Number(), 2);
  const Eigen::ArrayXd p = spring.parameters.col(0), q = spring.parameters.col(1);
  spring.modes.rightCols(2).setConstant(1);
  EXPECT_LT((spring.Frozen().col(1) + p * spring.states.col(0) + 1).abs().maxCoeff(), 1e-14);
  spring.modes.rightCols(2).setConstant(-1);
  EXPECT_LT((spring.Frozen().col(1) + q * spring.states.col(0) - 1).abs().maxCoeff(), 1e-14);
}

TEST(EquationSwitches, AreSharedByWhatChangesAtTheSameStates) {
  EXPECT_EQ(Switching("sign(y)*if(y > 0, 1, 2)*max(0, -3*y) + abs(-y/2)").Number(), 1);
  EXPECT_EQ(Switching("min(x, y) + sign(y - x) + if(2*x < 2*y, 1, 0)").Number(), 2);
  EXPECT_EQ(Switching("floor(x) + mod(x, 1)").Number(), 1);
  EXPECT_EQ(Switching("sign(x)*sign(y)").Number(), 2);
}

TEST(EquationSwitches, AreThereOnlyWhereSomethingSwitchesOnTheWay) {
  EXPECT_EQ(Switching("x*tanh(y)").Number(), 0);
  EXPECT_EQ(Switching("x*max(p, q) + if(p > 0, abs(q), 1)").Number(), 0);
  EXPECT_EQ(Switching("if(x == y, 1, 2)").Number(), 0);
  EXPECT_EQ(Switching("sign(u)").Number(), 1);
  EXPECT_EQ(Switching("if(t > p, 1, 2)").Number(), 1);
}

TEST(EquationSwitches, HaveTheSlopesOfTheirArguments) {
  Switching equations("sign(x^2*y + t*u - p) + floor(sin(x)*u)");
  ASSERT_EQ(equations.Number(), 2);
  const Eigen::ArrayXXd slopes = equations.Slopes();
  const Eigen::ArrayXXd before = equations.Arguments();
  constexpr double kDifference = 1e-6;
  for (Eigen::Index variable = 0; variable < 4; ++variable) {
    Switching moved = equations;
    (variable == 0   ? moved.modes.col(0)
     : variable == 3 ? moved.inputs.col(0)
                     : moved.states.col(variable - 1)) += kDifference;
    const Eigen::ArrayXXd differences = (moved.Arguments() - before) / kDifference;
    // The second derivatives are below 20.
    EXPECT_LT((slopes.middleCols(2 * variable, 2) - differences).abs().maxCoeff(),
              10 * kDifference + 1e-8)
        << variable;
  }
}

}  // namespace
}  // namespace polyest::internal
