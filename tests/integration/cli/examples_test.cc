// Tests that the examples' records tell the parameters that they were made with.

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

class ExamplesTest : public CommandTest {};

TEST_F(ExamplesTest, FindsTheTruthOfTheDemonstrationRecord) {
  const Finished run =
      Run({"estimate", Example("oscillator.json"), Example("oscillator.csv"), "--format", "json"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const v1::Estimate estimate = ParseEstimate(run.out);
  ASSERT_EQ(estimate.parameters_size(), 2);
  // The constants of generate_demo; four standard deviations hold but for one record in 10⁴.
  const auto& k = estimate.parameters(0);
  const auto& c = estimate.parameters(1);
  EXPECT_NEAR(k.map(), 41.3, 4 * k.std_dev());
  EXPECT_NEAR(c.map(), 0.23, 4 * c.std_dev());
  EXPECT_LT(k.std_dev(), 0.02);
  EXPECT_LT(c.std_dev(), 0.005);
  EXPECT_EQ(k.verdict(), v1::Identifiability::IDENTIFIED);
  EXPECT_EQ(estimate.samples(), 1000);
}

struct ExampleRecord {
  const char* name;
  std::map<std::string, double> truth;  // the constants of generate_demo
};

class ExampleRecords : public CommandTest, public testing::WithParamInterface<ExampleRecord> {};

// Four standard deviations hold for each parameter but for one record in 10⁴.
TEST_P(ExampleRecords, TellTheirTruth) {
  const auto& [name, truth] = GetParam();
  const Finished run = Run({"estimate", Example(std::string(name) + ".json"),
                            Example(std::string(name) + ".csv"), "--format", "json"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const v1::Estimate estimate = ParseEstimate(run.out);
  ASSERT_EQ(estimate.parameters_size(), truth.size());
  for (const auto& parameter : estimate.parameters()) {
    EXPECT_NEAR(parameter.map(), truth.at(parameter.name()), 4 * parameter.std_dev())
        << parameter.name();
    EXPECT_LT(parameter.contraction(), 0.1) << parameter.name();
    EXPECT_EQ(parameter.verdict(), v1::Identifiability::IDENTIFIED) << parameter.name();
  }
  EXPECT_EQ(estimate.diagnostics_size(), 0);
}

INSTANTIATE_TEST_SUITE_P(
    Examples, ExampleRecords,
    testing::Values(
        ExampleRecord{"roll_plane_4dof", {{"m_a", 185}, {"d", 0.48}}},
        ExampleRecord{"disturbed", {{"k", 41.3}, {"c", 0.23}, {"processNoise.v", 0.02}}},
        ExampleRecord{"rough_sensor", {{"k", 41.3}, {"c", 0.23}}},
        ExampleRecord{"releases",
                      {{"k", 41.3},
                       {"c", 0.23},
                       {"x0[0]", 0.83},
                       {"v0[0]", 0.6},
                       {"x0[1]", -0.42},
                       {"v0[1]", -1.3},
                       {"x0[2]", 1.17},
                       {"v0[2]", 0.2}}},
        ExampleRecord{"quarter_car", {{"ks", 15800}, {"cs", 1180}, {"kt", 204000}}},
        ExampleRecord{"bicycle", {{"Iz", 2410}, {"Cf", 76500}, {"Cr", 93800}, {"mu", 0.87}}},
        ExampleRecord{"chain",
                      {{"m1", 0.91},
                       {"m2", 1.12},
                       {"m3", 1.05},
                       {"m4", 0.88},
                       {"k1", 112},
                       {"k2", 87},
                       {"k3", 104},
                       {"k4", 95},
                       {"c1", 0.6},
                       {"c2", 1},
                       {"c3", 0.7},
                       {"c4", 0.9}}},
        ExampleRecord{
            "damper_rig",
            {{"m", 42.5}, {"k1", 11300}, {"s", 1.17}, {"y.delay", 0.0073}, {"force.offset", 21}}}),
    [](const auto& record) { return std::string(record.param.name); });

// The damper's coefficient falls to 0.8 + 0.4 e⁻³ N s/m.
TEST_F(ExamplesTest, FollowsADamperThatWarmsUp) {
  const Finished run =
      Run({"estimate", Example("warming.json"), Example("warming.csv"), "--format", "json"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const v1::Estimate estimate = ParseEstimate(run.out);
  ASSERT_EQ(estimate.parameters_size(), 3);
  EXPECT_NEAR(estimate.parameters(0).map(), 41.3, 4 * estimate.parameters(0).std_dev());
  EXPECT_NEAR(estimate.parameters(1).map(), 1.2, 4 * estimate.parameters(1).std_dev());
  EXPECT_EQ(estimate.parameters(2).name(), "c.drift");
  ASSERT_EQ(estimate.filtered_size(), 3);
  const v1::FilteredQuantity& now = estimate.filtered(2);
  EXPECT_EQ(now.name(), "c");
  EXPECT_EQ(now.unit(), "N s/m");
  EXPECT_NEAR(now.mean(), 0.8 + 0.4 * std::exp(-3), 4 * now.std_dev());
  EXPECT_LT(now.std_dev(), 0.02);
  EXPECT_EQ(estimate.diagnostics_size(), 0);
}

// The constants are those of generate_demo.cc; the spread's interval holds it, too.
TEST_F(ExamplesTest, FindsThePopulationOfTheSpecimens) {
  const Finished run =
      Run({"estimate", Example("specimens.json"), Example("specimens.csv"), "--format", "json"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  const v1::Estimate estimate = ParseEstimate(run.out);
  ASSERT_EQ(estimate.parameters_size(), 3);
  const auto& mean = estimate.parameters(1);
  const auto& spread = estimate.parameters(2);
  EXPECT_EQ(mean.name(), "k.mean");
  EXPECT_NEAR(mean.mean(), 41.3, 4 * mean.posterior_std_dev());
  EXPECT_EQ(spread.name(), "k.spread");
  EXPECT_EQ(spread.unit(), "N/m");
  EXPECT_LT(spread.lower95(), 1.6);
  EXPECT_GT(spread.upper95(), 1.6);
}

// Compares a model as text with the built-in one. The integrator takes the same steps, so that only
// rounding differs.
TEST_F(ExamplesTest, EstimatesTheSameFromAModelAsText) {
  const std::string text = File("text.json", R"({
    "model": {"equations": {"states": {"x": "v", "v": "-(k*x + c*v)/m"}, "outputs": {"x": "x"},
                            "parameters": {"m": 1, "x_0": 1}}},
    "uncertain": [{"name": "k", "uniform": {"lower": 31.584, "upper": 47.376}},
                  {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })");
  const std::string data = Example("oscillator.csv");
  const Finished as_text = Run({"estimate", text, data, "--format", "json"});
  const Finished built_in = Run({"estimate", Example("oscillator.json"), data, "--format", "json"});
  ASSERT_EQ(as_text.exit_status, 0) << as_text.err;
  const v1::Estimate a = ParseEstimate(as_text.out);
  const v1::Estimate b = ParseEstimate(built_in.out);
  for (int i = 0; i < 2; ++i) {
    const double std_dev = b.parameters(i).std_dev();
    EXPECT_NEAR(a.parameters(i).map(), b.parameters(i).map(), 1e-6 * std_dev);
    EXPECT_NEAR(a.parameters(i).std_dev(), std_dev, 1e-6 * std_dev);
  }
}

}  // namespace
}  // namespace polyest::internal
