// Equation models against the same models in C++, and what a model promises: its description, the
// same bits for a point in any place, exact derivatives.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/model/builtin/duffing.h"
#include "core/model/builtin/pendulum.h"
#include "core/model/lane_model.h"
#include "tests/unit/core/model/equations.h"

namespace polyest {
namespace {

EquationSpecification Duffing() {
  return {.states = {{"x", "v"}, {"v", "(force + offset - c*v - k*x - k2*x^2 - k3*x^3)/m"}},
          .outputs = {{"x", "x"}, {"v", "v"}},
          .parameters = {{"m", 1}},
          .inputs = {"force"}};
}

// The columns of the text model's alphabetical quantities in the order of the other model's.
Eigen::ArrayXXd Arrange(const Eigen::ArrayXXd& values, const std::vector<Quantity>& from,
                        const std::vector<Quantity>& to,
                        const std::map<std::string, std::string>& renamed = {}) {
  Eigen::ArrayXXd arranged(values.rows(), std::ssize(to));
  for (Eigen::Index j = 0; j < std::ssize(to); ++j) {
    const auto other = renamed.find(to[static_cast<size_t>(j)].name);
    const std::string name =
        other == renamed.end() ? to[static_cast<size_t>(j)].name : other->second;
    const auto at = std::find_if(from.begin(), from.end(),
                                 [&name](const Quantity& quantity) { return quantity.name == name; });
    EXPECT_NE(at, from.end()) << name;
    arranged.col(j) = values.col(at - from.begin());
  }
  return arranged;
}

// The same formula up to the order of operations: a few roundings of the largest term, below 100.
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
    const Eigen::ArrayXXd text_parameters = Arrange(parameters, b.parameters, a.parameters, initial);
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

}  // namespace
}  // namespace polyest
