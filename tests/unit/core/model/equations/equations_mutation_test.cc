// Tries tens of thousands of mutated texts, the same ones each time. Each is refused with a message
// or becomes a model that can be evaluated. tests/fuzz does this without end, where there is Clang.

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "core/model/equations/equation_model.h"

namespace polyest::internal {
namespace {

constexpr int kTexts = 20'000;

const char* const kSeeds[] = {
    "-(k*x + c*v + kc*x^3)/m + u/m",
    "if(x > 0 && !(v < 1e-3) || t >= 2, sqrt(abs(x)), min(x, v, 3)^-2)",
    "f(2*x) - g(x, v)*tanh(10*v) + atan2(v, x) + hypot(x, 1)",
    "log(exp(x) + 1.5)^0.3 + mod(t, pi) - floor(v/2) + sign(x)*log10(4)",
};

const char* const kPieces[] = {"(",  ")",  ",",    "+",   "-",  "*",     "/",   "^",
                               "<=", "==", "&&",   "||",  "!",  "1e308", "0",   "x",
                               "v",  "a",  "sin(", "if(", "f(", "g(",    "t",   "pi",
                               " ",  "\n", "\xff", "x_0", "^2", "^0.5",  "1/0", "max("};

// Returns a number below the bound, the same on every platform, unlike
// std::uniform_int_distribution.
size_t Below(std::mt19937_64& random, size_t bound) { return random() % bound; }

std::string Mutate(std::string text, std::mt19937_64& random) {
  const size_t changes = 1 + Below(random, 2);
  for (size_t i = 0; i < changes; ++i) {
    const size_t at = Below(random, text.size() + 1);
    const size_t length = Below(random, 6);
    switch (Below(random, 4)) {
      case 0:
        text.insert(at, kPieces[Below(random, std::size(kPieces))]);
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        text.insert(at, text.substr(Below(random, text.size() + 1), 4 * length));
        break;
      default:
        if (at < text.size()) text[at] = static_cast<char>(Below(random, 256));
    }
  }
  return text;
}

void Evaluate(const StateSpaceModel& model) {
  const ModelDescription& description = model.description();
  const auto ones = [](size_t columns) -> Eigen::ArrayXXd {
    return Eigen::ArrayXXd::Ones(kLanes, static_cast<Eigen::Index>(columns));
  };
  const Eigen::ArrayXXd parameters = ones(description.parameters.size());
  const Eigen::ArrayXXd inputs = ones(description.inputs.size());
  const Eigen::ArrayXXd states = ones(description.states.size());
  Eigen::ArrayXXd rates = states, jacobian = ones(states.cols() * states.cols());
  Eigen::ArrayXXd outputs = ones(description.outputs.size());
  model.Derivatives(0.5, states, parameters, inputs, rates);
  model.Outputs(0.5, states, parameters, inputs, outputs);
  if (model.has_state_jacobian()) {
    model.StateJacobian(0.5, states, parameters, inputs, jacobian);
  }
}

TEST(EquationMutations, AreRefusedInWordsOrCanBeEvaluated) {
  std::mt19937_64 random(1);
  int models = 0;
  for (int i = 0; i < kTexts; ++i) {
    const std::string state = Mutate(kSeeds[Below(random, std::size(kSeeds))], random);
    const std::string other = Mutate(kSeeds[Below(random, std::size(kSeeds))], random);
    EquationSpecification equations = {
        .states = {{"x", "v"}, {"v", state}},
        .outputs = {{"y", i % 2 == 0 ? "a" : "x"}},
        .intermediates = {{"a", i % 2 == 0 ? other : "1"}},
        .inputs = {"u"},
        .tables = {{"f", {{0, 1, 2}, {}, {1, 3, 2}, true}}, {"g", {{0, 1}, {0, 1}, {1, 2, 3, 4}}}}};
    if (i % 4 == 0) equations.units = {{"x", "m"}, {"v", "m/s"}, {"k", "N/m"}};
    const auto model = MakeEquationModel(equations);
    if (model.ok()) {
      ++models;
      Evaluate(**model);
    } else {
      ASSERT_EQ(model.status().message().find("model.equations"), 0u) << model.status();
    }
  }
  // Mutations are small enough to leave some models and large enough to break some.
  EXPECT_GT(models, kTexts / 20);
  EXPECT_LT(models, kTexts * 19 / 20);
}

}  // namespace
}  // namespace polyest::internal
