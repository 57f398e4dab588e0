// Compares equation models with the same models in C++, and tests what a model promises: its
// description, the same bits for a point in any place, exact derivatives.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/check.h"
#include "core/model/builtin/duffing.h"
#include "core/model/builtin/pendulum.h"
#include "core/model/lane_model.h"
#include "tests/bench/half_car.h"
#include "tests/bench/half_car_equations.h"
#include "tests/unit/core/model/equations/equations.h"

namespace polyest::internal {
namespace {

EquationSpecification Duffing() {
  return {.states = {{"x", "v"}, {"v", "(force + offset - c*v - k*x - k2*x^2 - k3*x^3)/m"}},
          .outputs = {{"x", "x"}, {"v", "v"}},
          .parameters = {{"m", 1}},
          .inputs = {"force"}};
}

// Returns the columns of the text model's alphabetical quantities in the order of the other
// model's.
Eigen::ArrayXXd Arrange(const Eigen::ArrayXXd& values, const std::vector<Quantity>& from,
                        const std::vector<Quantity>& to,
                        const std::map<std::string, std::string>& renamed = {}) {
  Eigen::ArrayXXd arranged(values.rows(), std::ssize(to));
  for (Eigen::Index j = 0; j < std::ssize(to); ++j) {
    const auto other = renamed.find(to[static_cast<size_t>(j)].name);
    const std::string name =
        other == renamed.end() ? to[static_cast<size_t>(j)].name : other->second;
    const auto at = std::find_if(from.begin(), from.end(), [&name](const Quantity& quantity) {
      return quantity.name == name;
    });
    EXPECT_NE(at, from.end()) << name;
    arranged.col(j) = values.col(at - from.begin());
  }
  return arranged;
}

// Expects the same formula up to the order of operations: a few roundings of the largest term,
// below 100.
void ExpectSame(const StateSpaceModel& text, const StateSpaceModel& other,
                const std::map<std::string, std::string>& initial) {
  const ModelDescription& a = text.description();
  const ModelDescription& b = other.description();
  for (const Eigen::Index rows : {kLanes, 64, 136}) {
    const Eigen::ArrayXXd states = Varied(rows, std::ssize(b.states), 1);
    const Eigen::ArrayXXd parameters = Varied(rows, std::ssize(b.parameters), 2) + 2;
    const Eigen::ArrayXXd inputs = Varied(rows, std::ssize(b.inputs), 3);
    std::map<std::string, std::string> back;
    for (const auto& [name, builtin] : initial) back[builtin] = name;
    const Eigen::ArrayXXd text_states = Arrange(states, b.states, a.states);
    const Eigen::ArrayXXd text_parameters =
        Arrange(parameters, b.parameters, a.parameters, initial);
    Eigen::ArrayXXd result(rows, states.cols()), expected(rows, states.cols());
    text.Derivatives(0.3, text_states, text_parameters, inputs, result);
    other.Derivatives(0.3, states, parameters, inputs, expected);
    EXPECT_LT((Arrange(result, a.states, b.states) - expected).abs().maxCoeff(), 1e-13);
    text.InitialStates(text_parameters, result);
    other.InitialStates(parameters, expected);
    EXPECT_TRUE((Arrange(result, a.states, b.states) == expected).all());
    text.Outputs(0.3, text_states, text_parameters, inputs, result);
    other.Outputs(0.3, states, parameters, inputs, expected);
    EXPECT_TRUE((Arrange(result, a.outputs, b.outputs) == expected).all());
  }
}

TEST(EquationModel, AgreesWithTheBuiltInDuffingOscillator) {
  const auto model = MakeOrFail(Duffing());
  ASSERT_NE(model, nullptr);
  ExpectSame(*model, LaneModel<builtin::Duffing>(), {{"x_0", "x0"}, {"v_0", "v0"}});
}

TEST(EquationModel, AgreesWithTheBuiltInPendulum) {
  const auto model =
      MakeOrFail({.states = {{"theta", "omega"},
                             {"omega", "-g_over_l*sin(theta) - (c + c2*abs(omega))*omega"}},
                  .outputs = {{"theta", "theta"}, {"omega", "omega"}}});
  ASSERT_NE(model, nullptr);
  ExpectSame(*model, LaneModel<builtin::Pendulum>(),
             {{"theta_0", "theta0"}, {"omega_0", "omega0"}});
}

// The forces are 1e5 N, of which rounding leaves 1e-11 N, over masses down to 36 kg.
TEST(EquationModel, AgreesWithAHalfCarWrittenByHand) {
  const auto text = MakeOrFail(bench::HalfCarEquations());
  ASSERT_NE(text, nullptr);
  const LaneModel<bench::HalfCar> car;
  const std::vector<Quantity>& order = text->description().states;
  const std::vector<Quantity>& car_order = car.description().states;
  const Eigen::ArrayXXd states = Varied(64, 8, 1);
  const Eigen::ArrayXXd parameters = Varied(64, 2, 2) * 0.3 + 1;  // of m_a, d
  const Eigen::ArrayXXd inputs = Varied(64, 2, 3);
  const Eigen::ArrayXXd text_states = Arrange(states, car_order, order);
  Eigen::ArrayXXd all_parameters = Eigen::ArrayXXd::Zero(64, 10);
  all_parameters.leftCols(2) =
      Arrange(parameters, car.description().parameters,
              {text->description().parameters[0], text->description().parameters[1]});
  Eigen::ArrayXXd result(64, 8), expected(64, 8);
  text->Derivatives(0, text_states, all_parameters, inputs, result);
  car.Derivatives(0, states, parameters, inputs, expected);
  const Eigen::ArrayXXd error =
      (Arrange(result, order, car_order) - expected) / expected.abs().max(100);
  EXPECT_LT(error.abs().maxCoeff(), 1e-13);
  Eigen::ArrayXXd outputs(64, 4), expected_outputs(64, 4);
  text->Outputs(0, text_states, all_parameters, inputs, outputs);
  car.Outputs(0, states, parameters, inputs, expected_outputs);
  EXPECT_TRUE(
      (Arrange(outputs, text->description().outputs, car.description().outputs) == expected_outputs)
          .all());
}

std::vector<std::string> Names(const std::vector<Quantity>& quantities) {
  std::vector<std::string> names;
  for (const Quantity& quantity : quantities) names.push_back(quantity.name);
  return names;
}

TEST(EquationModel, DescribesItself) {
  const auto model = MakeOrFail(
      {.states = {{"x", "v"}, {"v", "-(k*x + c*v + kc*x^3)/m + u/m"}},
       .outputs = {{"x", "x"}, {"a", "-(k*x + c*v)/m"}},
       .parameters = {{"m", 1.5}, {"v_0", 0.25}},
       .inputs = {"u"},
       .units = {{"x", "m"}, {"v", "m/s"}, {"m", "kg"}, {"k", "N/m"}, {"c", "N s/m"}, {"u", "N"}}});
  ASSERT_NE(model, nullptr);
  const ModelDescription& description = model->description();
  EXPECT_EQ(Names(description.states), (std::vector<std::string>{"v", "x"}));
  EXPECT_EQ(Names(description.outputs), (std::vector<std::string>{"a", "x"}));
  EXPECT_EQ(Names(description.inputs), (std::vector<std::string>{"u"}));
  EXPECT_EQ(Names(description.parameters),
            (std::vector<std::string>{"c", "k", "kc", "m", "v_0", "x_0"}));
  const auto parameter = [&description](const char* name) -> const Quantity& {
    return description.parameters[static_cast<size_t>(*description.FindParameter(name))];
  };
  for (const char* name : {"c", "k", "kc"}) EXPECT_FALSE(parameter(name).has_default) << name;
  EXPECT_TRUE(parameter("m").has_default);
  EXPECT_EQ(parameter("m").default_value, 1.5);
  EXPECT_EQ(parameter("m").unit, "kg");
  EXPECT_TRUE(parameter("v_0").has_default);
  EXPECT_EQ(parameter("v_0").default_value, 0.25);
  EXPECT_EQ(parameter("v_0").unit, "m/s");
  EXPECT_TRUE(parameter("x_0").has_default);
  EXPECT_EQ(parameter("x_0").default_value, 0);
  EXPECT_EQ(parameter("kc").unit, "");
  // The unit follows from the expression; the problem does not give it.
  EXPECT_EQ(description.outputs[0].unit, "m/s^2");
  EXPECT_EQ(description.outputs[1].unit, "m");
}

TEST(EquationModel, MayDoWithoutStates) {
  const auto model = MakeOrFail({.outputs = {{"omega", "sqrt(k/m) + 0*t"}}});
  ASSERT_NE(model, nullptr);
  EXPECT_TRUE(model->description().states.empty());
  EXPECT_FALSE(model->has_state_jacobian());
  Eigen::ArrayXXd parameters(kLanes, 2), outputs(kLanes, 1);
  parameters.col(0).setConstant(9);
  parameters.col(1).setConstant(4);
  model->Outputs(0, Eigen::ArrayXXd(kLanes, 0), parameters, Eigen::ArrayXXd(kLanes, 0), outputs);
  EXPECT_TRUE((outputs == 1.5).all());
}

TEST(EquationModel, KnowsTheTimeAndUsesInitialValuesAsParameters) {
  const auto model =
      MakeOrFail({.states = {{"x", "cos(w*t)"}}, .outputs = {{"moved", "x - x_0"}, {"t2", "2*t"}}});
  ASSERT_NE(model, nullptr);
  Eigen::ArrayXXd parameters(kLanes, 2), states(kLanes, 1), rates(kLanes, 1), outputs(kLanes, 2);
  parameters.col(0).setConstant(3);     // w
  parameters.col(1).setConstant(0.25);  // x_0
  model->InitialStates(parameters, states);
  EXPECT_TRUE((states == 0.25).all());
  model->Derivatives(2, states, parameters, Eigen::ArrayXXd(kLanes, 0), rates);
  // The cosine of libmvec is off by up to four units in the last place.
  EXPECT_LT((rates - std::cos(6.0)).abs().maxCoeff(), 4.5e-16);
  model->Outputs(2, states + 1, parameters, Eigen::ArrayXXd(kLanes, 0), outputs);
  EXPECT_TRUE((outputs.col(0) == 1).all());
  EXPECT_TRUE((outputs.col(1) == 4).all());
}

// Lists every function that is not exact, so that different ways of computing it would show.
EquationSpecification Everything() {
  return {.states = {{"x", "exp(-x^2)*sin(w*v + t) + tanh(x)^1.3 - f(x) + g(x, v)"},
                     {"v", "log(2 + x)/sqrt(k + v^2) + cosh(v) + hypot(x, v) + atan2(v, x)"}},
          .outputs = {{"y", "if(x > v, exp(x), log10(3 + v)) + max(x, v, u)"}},
          .inputs = {"u"},
          .tables = {{"f", {{-1, 0, 1}, {}, {1, 0, 3}, true}},
                     {"g", {{-1, 0, 1}, {-1, 1}, {1, 2, 3, 4, 5, 7}}}}};
}

TEST(EquationModel, GivesAPointTheSameBitsInAnyPlaceOfABlockOfAnySize) {
  const auto model = MakeOrFail(Everything());
  ASSERT_NE(model, nullptr);
  Eigen::ArrayXXd first;
  for (const Eigen::Index rows : {1 * kLanes, 3 * kLanes, 64, 72, 200}) {
    const Eigen::ArrayXXd states = (0.5 + 0.4 * Varied(1, 2, 1)).replicate(rows, 1);
    const Eigen::ArrayXXd parameters = (2 + Varied(1, 4, 2)).replicate(rows, 1);
    const Eigen::ArrayXXd inputs = Varied(1, 1, 3).replicate(rows, 1);
    Eigen::ArrayXXd all(rows, 7);
    model->Derivatives(0.3, states, parameters, inputs, all.leftCols(2));
    model->Outputs(0.3, states, parameters, inputs, all.middleCols(2, 1));
    model->StateJacobian(0.3, states, parameters, inputs, all.rightCols(4));
    if (first.size() == 0) first = all.row(0);
    EXPECT_TRUE((all == first.replicate(rows, 1)).all()) << rows;
  }
}

TEST(EquationModel, WorksOnPartOfALargerBlockAndWritesNothingElse) {
  const auto model = MakeOrFail(Everything());
  ASSERT_NE(model, nullptr);
  constexpr Eigen::Index kFirst = 3, kRows = 24, kLarger = 40;
  const Eigen::ArrayXXd states = 0.5 + 0.4 * Varied(kLarger, 2, 1);
  const Eigen::ArrayXXd parameters = 2 + Varied(kLarger, 4, 2);
  const Eigen::ArrayXXd inputs = Varied(kLarger, 1, 3);
  Eigen::ArrayXXd rates = Eigen::ArrayXXd::Constant(kLarger, 2, -99);
  model->Derivatives(0, states.middleRows(kFirst, kRows), parameters.middleRows(kFirst, kRows),
                     inputs.middleRows(kFirst, kRows), rates.middleRows(kFirst, kRows));
  Eigen::ArrayXXd expected(kLarger, 2);
  model->Derivatives(0, states, parameters, inputs, expected);
  EXPECT_TRUE((rates.middleRows(kFirst, kRows) == expected.middleRows(kFirst, kRows)).all());
  EXPECT_TRUE((rates.topRows(kFirst) == -99).all());
  EXPECT_TRUE((rates.bottomRows(kLarger - kFirst - kRows) == -99).all());
}

// The oracle is ∂f/∂x of the Duffing oscillator with the states v, x: ∂v̇/∂v = −c/m, ∂v̇/∂x = −(k +
// 2 k2 x + 3 k3 x²)/m.
TEST(EquationModel, HasTheExactJacobianOfTheDuffingOscillator) {
  const auto model = MakeOrFail(Duffing());
  ASSERT_NE(model, nullptr);
  ASSERT_TRUE(model->has_state_jacobian());
  const ModelDescription& description = model->description();
  const Eigen::ArrayXXd states = Varied(64, 2, 1);
  const Eigen::ArrayXXd parameters = 2 + Varied(64, 8, 2);
  const Eigen::ArrayXXd inputs = Varied(64, 1, 3);
  Eigen::ArrayXXd jacobian(64, 4);
  model->StateJacobian(0, states, parameters, inputs, jacobian);
  const auto p = [&](const char* name) { return parameters.col(*description.FindParameter(name)); };
  const auto x = states.col(1);
  const auto near = [](const Eigen::ArrayXd& a, const Eigen::ArrayXd& b) {
    return (a - b).abs().maxCoeff() < 1e-13;
  };
  EXPECT_TRUE(near(jacobian.col(0), -p("c") / p("m")));
  EXPECT_TRUE((jacobian.col(1) == 1).all());
  EXPECT_TRUE(near(jacobian.col(2), -(p("k") + 2 * p("k2") * x + 3 * p("k3") * x * x) / p("m")));
  EXPECT_TRUE((jacobian.col(3) == 0).all());
}

// Central differences with a step h = 1e-5 err by h²/6 of the third derivatives, here below 100,
// and by a rounding of 1e-11.
TEST(EquationModel, HasAJacobianThatAgreesWithDifferences) {
  const auto model = MakeOrFail(Everything());
  ASSERT_NE(model, nullptr);
  const Eigen::ArrayXXd states = 0.5 + 0.35 * Varied(64, 2, 1);
  const Eigen::ArrayXXd parameters = 2 + Varied(64, 4, 2);
  const Eigen::ArrayXXd inputs = Varied(64, 1, 3);
  Eigen::ArrayXXd jacobian(64, 4), above(64, 2), below(64, 2);
  model->StateJacobian(0.3, states, parameters, inputs, jacobian);
  for (Eigen::Index s = 0; s < 2; ++s) {
    constexpr double kStep = 1e-5;
    Eigen::ArrayXXd moved = states;
    moved.col(s) += kStep;
    model->Derivatives(0.3, moved, parameters, inputs, above);
    moved.col(s) -= 2 * kStep;
    model->Derivatives(0.3, moved, parameters, inputs, below);
    const Eigen::ArrayXXd difference = (above - below) / (2 * kStep);
    EXPECT_LT((difference - jacobian.middleCols(2 * s, 2)).abs().maxCoeff(), 2e-9);
  }
}

TEST(EquationModelCheck, RefusesBlocksOfTheWrongShape) {
  const auto model = MakeOrFail(Duffing());
  ASSERT_NE(model, nullptr);
  const Eigen::ArrayXXd states = Varied(kLanes, 2, 0), parameters = Varied(kLanes, 8, 0);
  Eigen::ArrayXXd rates(kLanes, 2);
  EXPECT_THROW(model->Derivatives(0, states, parameters, Varied(kLanes, 2, 0), rates),
               CheckFailure);
  EXPECT_THROW(model->Derivatives(0, states, Varied(kLanes, 7, 0), Varied(kLanes, 1, 0), rates),
               CheckFailure);
  EXPECT_THROW(model->InitialStates(Varied(kLanes + 1, 8, 0), rates), CheckFailure);
}

}  // namespace
}  // namespace polyest::internal
