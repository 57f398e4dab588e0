// Tests gain, delay and offset of an input's channel and the offset of an output's, which are
// uncertain like any parameter of the model. The truth is a run of the model with these values at a
// tight tolerance.

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "core/estimator/problem/resolved_problem.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal::channel_estimates_test {
namespace {

constexpr double kNoise = 0.002;

double Force(double t) { return std::sin(5.1 * t) + 0.7 * std::sin(8.3 * t + 1) + 0.3; }

Problem ChannelProblem() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"c", 0.8}};
  problem.inputs = {{"force", StreamedInput{}}};
  problem.measured = {{"x", {.absolute = kNoise}}};
  problem.uncertain = {UncertainParameter::Uniform("k", 30, 50).value(),
                       UncertainParameter::Uniform("force.delay", 0, 0.1).value(),
                       UncertainParameter::Normal("force.gain", 1, 0.2).value(),
                       UncertainParameter::Normal("x.offset", 0, 0.1).value()};
  return problem;
}

TEST(ChannelParameters, AreEstimatedLikeAnyOther) {
  const std::vector<double> truth = {41.3, 0.043, 1.12, 0.031};
  Samples record;
  record.columns = {{"x", {}, {}}, {"force", {}, {}}};
  record.end_of_run = true;
  for (int k = 0; k < 400; ++k) {
    record.time_s.push_back(0.02 * k);
    record.columns[1].value.push_back(Force(record.time_s.back()));
  }
  Problem exact = ChannelProblem();
  exact.inputs = {
      {"force", TableInput{record.time_s, record.columns[1].value, Interpolation::kCubic, 1}}};
  exact.integration.relative_tolerance = 1e-12;
  const ResolvedProblem resolved = ResolvedProblem::Make(exact).value();
  const InputSignals inputs = resolved.MakeInputs();
  const Matrix theta = Eigen::Map<const Eigen::RowVectorXd>(truth.data(), 4);
  EnsemblePropagator model(resolved.MakeEnsemble(theta, resolved.outputs(), 1), &inputs);
  Matrix outputs(1, 400);
  ASSERT_TRUE(model.Advance(record.time_s, outputs, {}).ok());
  std::mt19937_64 generator(3);
  std::normal_distribution<double> noise(0, kNoise);
  for (const double x : outputs.reshaped()) {
    record.columns[0].value.push_back(x + noise(generator));
  }
  const Estimate estimate = EstimateOf(ChannelProblem(), record);
  for (size_t i = 0; i < truth.size(); ++i) {
    const ParameterEstimate& parameter = estimate.parameters[i];
    // The bound is four standard deviations, which gives a false alarm in 10⁴ seeds.
    EXPECT_NEAR(parameter.map, truth[i], 4 * parameter.std_dev) << parameter.name;
    EXPECT_EQ(parameter.verdict, Verdict::kIdentified) << parameter.name;
    EXPECT_LT(parameter.contraction, 0.1) << parameter.name;
  }
  EXPECT_EQ(estimate.parameters[1].unit, "s");
  EXPECT_EQ(estimate.parameters[3].unit, "m");
  EXPECT_NEAR(estimate.channels[0].chi_squared, 400, 4 * std::sqrt(800));
}

std::string RefusalOf(const std::function<void(Problem&)>& change) {
  Problem problem = ChannelProblem();
  change(problem);
  return std::string(ResolvedProblem::Make(std::move(problem)).status().message());
}

TEST(ChannelParameters, NeedTheirChannel) {
  EXPECT_EQ(RefusalOf([](Problem& p) { p.inputs.clear(); }),
            "uncertain[1]: force.delay needs a signal for input force in inputs");
  EXPECT_EQ(RefusalOf([](Problem& p) { p.fixed["v.gain"] = 2; }),
            "fixed.v.gain: v.gain needs output v in measured");
}

TEST(ChannelParameters, GoIntoTheEnsemble) {
  Problem problem = ChannelProblem();
  problem.fixed["force.amplitude"] = 3;
  problem.fixed["x.gain"] = 0.5;
  const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
  const Matrix theta = Eigen::RowVector4d(40, 0.05, 2, 0.25);
  const EnsembleSpecification ensemble = resolved.MakeEnsemble(theta, {0}, 1);
  EXPECT_EQ(ensemble.amplitudes(0, 0), 6);
  EXPECT_EQ(ensemble.input_delays_s(0, 0), 0.05);
  EXPECT_EQ(ensemble.input_offsets.size(), 0);
  EXPECT_EQ(ensemble.output_gains(0, 0), 0.5);
  EXPECT_EQ(ensemble.output_offsets(0, 0), 0.25);
}

TEST(ProblemOfChannels, ListsAllThatIsWrongAtOnce) {
  Problem problem = ChannelProblem();
  problem.fixed["mass"] = 1;
  problem.fixed["x0"] = std::numeric_limits<double>::infinity();
  problem.uncertain[0].name = "stiffness";
  problem.measured.push_back({"y", {.absolute = 1}});
  problem.expansion.order = 0;
  std::vector<std::string> messages;
  for (const absl::Status& refusal : ResolvedProblem::Check(problem)) {
    messages.emplace_back(refusal.message());
  }
  using ::testing::HasSubstr;
  EXPECT_THAT(messages, ::testing::ElementsAre(HasSubstr("expansion.order: 0"),
                                               HasSubstr("measured[1]"), HasSubstr("fixed.mass"),
                                               HasSubstr("fixed.x0"), HasSubstr("\"stiffness\"")));
}

}  // namespace
}  // namespace polyest::internal::channel_estimates_test
