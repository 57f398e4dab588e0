#include "polyest/catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/model/list_names.h"

namespace polyest::internal::catalogue_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

std::vector<std::string> Names(const std::vector<Quantity>& quantities) {
  std::vector<std::string> names;
  for (const Quantity& quantity : quantities) names.push_back(quantity.name);
  return names;
}

std::vector<std::pair<std::string, double>> Defaults(const ModelDescription& model) {
  std::vector<std::pair<std::string, double>> defaults;
  for (const Quantity& parameter : model.parameters) {
    defaults.emplace_back(parameter.name, parameter.default_value);
  }
  return defaults;
}

const ModelDescription& Describe(const std::string& name) {
  return FindBuiltinModel(name).value()->description();
}

// The names and numbers below are those of the documentation's table of built-in models. Springs
// are at 1 Hz.
const double kOmegaSquared = std::pow(2 * std::numbers::pi, 2);

TEST(Catalogue, ListsTheModelsInTheOrderOfTheDocumentation) {
  std::vector<std::string> names;
  for (const auto& model : BuiltinModels()) names.push_back(model->description().name);
  EXPECT_THAT(names, ElementsAre("mass_spring_damper", "mass_spring_frequency", "linear_two_state",
                                 "roll_plane_2dof", "roll_plane_4dof", "quarter_car", "bicycle",
                                 "duffing", "pendulum"));
}

TEST(Catalogue, FindsEveryModelByItsName) {
  for (const auto& model : BuiltinModels()) {
    EXPECT_EQ(FindBuiltinModel(model->description().name).value(), model);
  }
}

TEST(Catalogue, AnswersAnUnknownNameWithTheNamesThereAre) {
  const absl::Status status = FindBuiltinModel("mass_spring").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("\"mass_spring\""));
  for (const auto& model : BuiltinModels()) {
    EXPECT_THAT(std::string(status.message()), HasSubstr(model->description().name));
  }
}

TEST(Catalogue, EveryModelSaysWhatItIs) {
  for (const auto& model : BuiltinModels()) {
    const ModelDescription& description = model->description();
    SCOPED_TRACE(description.name);
    EXPECT_FALSE(description.summary.empty());
    EXPECT_FALSE(description.equations.empty());
    EXPECT_FALSE(description.source.empty());
    EXPECT_FALSE(description.outputs.empty());
  }
}

TEST(Catalogue, EveryQuantityHasAUnitAMeaningAndADefault) {
  for (const auto& model : BuiltinModels()) {
    const ModelDescription& description = model->description();
    for (const auto* quantities : {&description.states, &description.parameters,
                                   &description.inputs, &description.outputs}) {
      std::set<std::string> names;
      for (const Quantity& quantity : *quantities) {
        SCOPED_TRACE(description.name + "." + quantity.name);
        EXPECT_TRUE(names.insert(quantity.name).second) << "named twice";
        EXPECT_FALSE(quantity.unit.empty());
        EXPECT_FALSE(quantity.meaning.empty());
        EXPECT_EQ(quantity.meaning.find('\n'), std::string::npos);
        // Only the friction is infinite, which makes a linear tyre.
        const bool unbounded = description.name == "bicycle" && quantity.name == "mu";
        EXPECT_EQ(std::isfinite(quantity.default_value), !unbounded);
        EXPECT_FALSE(std::isnan(quantity.default_value));
      }
    }
  }
}

TEST(Catalogue, MassSpringDamperIsAsDocumented) {
  const ModelDescription& model = Describe("mass_spring_damper");
  EXPECT_THAT(Names(model.states), ElementsAre("x", "v"));
  EXPECT_THAT(Defaults(model), ElementsAre(Pair("m", 0.1), Pair("c", 0.0),
                                           Pair("k", ::testing::DoubleEq(0.1 * kOmegaSquared)),
                                           Pair("x0", 0.0), Pair("v0", 0.0)));
  EXPECT_THAT(Names(model.inputs), ElementsAre("force"));
  EXPECT_THAT(Names(model.outputs), ElementsAre("x", "v", "a"));
}

TEST(Catalogue, MassSpringFrequencyIsAsDocumented) {
  const ModelDescription& model = Describe("mass_spring_frequency");
  EXPECT_THAT(model.states, IsEmpty());
  EXPECT_THAT(Defaults(model),
              ElementsAre(Pair("m", 200.0), Pair("k", ::testing::DoubleEq(200 * kOmegaSquared))));
  EXPECT_THAT(model.inputs, IsEmpty());
  EXPECT_THAT(Names(model.outputs), ElementsAre("omega"));
  EXPECT_EQ(model.outputs[0].unit, "rad/s");
}

TEST(Catalogue, LinearTwoStateIsAsDocumented) {
  const ModelDescription& model = Describe("linear_two_state");
  EXPECT_THAT(Names(model.states), ElementsAre("x1", "x2"));
  EXPECT_THAT(Defaults(model),
              ElementsAre(Pair("theta", 0.0), Pair("x1_0", 0.0), Pair("x2_0", 0.0)));
  EXPECT_THAT(Names(model.inputs), ElementsAre("u1", "u2"));
  EXPECT_THAT(Names(model.outputs), ElementsAre("x1", "x2", "x1_minus_x2"));
}

TEST(Catalogue, RollPlane2DofIsAsDocumented) {
  const ModelDescription& model = Describe("roll_plane_2dof");
  EXPECT_THAT(Names(model.states), ElementsAre("x1", "x2", "v1", "v2"));
  EXPECT_THAT(Defaults(model),
              ElementsAre(Pair("M", 580.0), Pair("I", 63.3316), Pair("L", 1.524),
                          Pair("k1", 19357.2), Pair("k2", 19357.2), Pair("x1_0", 0.0),
                          Pair("x2_0", 0.0), Pair("v1_0", 0.0), Pair("v2_0", 0.0)));
  EXPECT_THAT(Names(model.inputs), ElementsAre("u1", "u2"));
  EXPECT_THAT(Names(model.outputs), ElementsAre("x1", "x2", "v1", "v2"));
}

TEST(Catalogue, RollPlane4DofIsAsDocumented) {
  const ModelDescription& model = Describe("roll_plane_4dof");
  EXPECT_THAT(Names(model.states), ElementsAre("x1", "x2", "xt1", "xt2", "v1", "v2", "vt1", "vt2"));
  EXPECT_THAT(
      Defaults(model),
      ElementsAre(Pair("M", 580.0), Pair("I", 63.3316), Pair("L", 1.524), Pair("m_t", 36.26),
                  Pair("k", 19357.2), Pair("k3", 100000.0), Pair("c_f", 142.14),
                  Pair("k_t", 96319.76), Pair("m_a", 0.0), Pair("d", 0.762), Pair("x1_0", 0.0),
                  Pair("x2_0", 0.0), Pair("xt1_0", 0.0), Pair("xt2_0", 0.0), Pair("v1_0", 0.0),
                  Pair("v2_0", 0.0), Pair("vt1_0", 0.0), Pair("vt2_0", 0.0)));
  EXPECT_THAT(Names(model.inputs), ElementsAre("y1", "y2"));
  EXPECT_THAT(Names(model.outputs),
              ElementsAre("d1", "d2", "d1_rate", "d2_rate", "x1", "x2", "xt1", "xt2", "a1", "a2"));
}

TEST(Catalogue, QuarterCarIsAsDocumented) {
  const ModelDescription& model = Describe("quarter_car");
  EXPECT_THAT(Names(model.states), ElementsAre("zs", "zu", "vs", "vu"));
  EXPECT_THAT(Defaults(model), ElementsAre(Pair("ms", 290.0), Pair("mu", 59.0), Pair("ks", 16800.0),
                                           Pair("cs", 1000.0), Pair("kt", 190000.0),
                                           Pair("ks3", 0.0), Pair("zs_0", 0.0), Pair("zu_0", 0.0),
                                           Pair("vs_0", 0.0), Pair("vu_0", 0.0)));
  EXPECT_THAT(Names(model.inputs), ElementsAre("road"));
  EXPECT_THAT(Names(model.outputs), ElementsAre("zs", "zu", "travel", "travel_rate", "zs_accel"));
}

TEST(Catalogue, BicycleIsAsDocumented) {
  const ModelDescription& model = Describe("bicycle");
  EXPECT_THAT(Names(model.states), ElementsAre("vy", "r"));
  EXPECT_THAT(Defaults(model),
              ElementsAre(Pair("m", 1500.0), Pair("Iz", 2500.0), Pair("lf", 1.2), Pair("lr", 1.4),
                          Pair("Cf", 80000.0), Pair("Cr", 90000.0),
                          Pair("mu", std::numeric_limits<double>::infinity()), Pair("vy_0", 0.0),
                          Pair("r_0", 0.0)));
  EXPECT_THAT(Names(model.inputs), ElementsAre("vx", "delta"));
  EXPECT_THAT(Names(model.outputs), ElementsAre("vy", "r", "ay", "beta"));
}

TEST(Catalogue, DuffingIsAsDocumented) {
  const ModelDescription& model = Describe("duffing");
  EXPECT_THAT(Names(model.states), ElementsAre("x", "v"));
  EXPECT_THAT(Defaults(model),
              ElementsAre(Pair("m", 1.0), Pair("c", 0.1), Pair("k", 1.0), Pair("k2", 0.0),
                          Pair("k3", 1.0), Pair("offset", 0.0), Pair("x0", 0.0), Pair("v0", 0.0)));
  EXPECT_THAT(Names(model.inputs), ElementsAre("force"));
  EXPECT_THAT(Names(model.outputs), ElementsAre("x", "v"));
}

TEST(Catalogue, PendulumIsAsDocumented) {
  const ModelDescription& model = Describe("pendulum");
  EXPECT_THAT(Names(model.states), ElementsAre("theta", "omega"));
  EXPECT_THAT(Defaults(model), ElementsAre(Pair("g_over_l", 9.81), Pair("c", 0.0), Pair("c2", 0.0),
                                           Pair("theta0", 0.0), Pair("omega0", 0.0)));
  EXPECT_THAT(model.inputs, IsEmpty());
  EXPECT_THAT(Names(model.outputs), ElementsAre("theta", "omega"));
}

TEST(ModelDescription, FindsQuantitiesByName) {
  const ModelDescription& model = Describe("mass_spring_damper");
  EXPECT_EQ(model.FindParameter("k"), 2);
  EXPECT_EQ(model.FindParameter("force"), std::nullopt);
  EXPECT_EQ(model.FindInput("force"), 0);
  EXPECT_EQ(model.FindInput("x"), std::nullopt);
  EXPECT_EQ(model.FindOutput("a"), 2);
  EXPECT_EQ(model.FindOutput(""), std::nullopt);
}

TEST(ModelDescription, ListsNamesForMessages) {
  EXPECT_EQ(ListNames(Describe("pendulum").parameters), "g_over_l, c, c2, theta0, omega0");
  EXPECT_EQ(ListNames({}), "none");
}

}  // namespace
}  // namespace polyest::internal::catalogue_test
