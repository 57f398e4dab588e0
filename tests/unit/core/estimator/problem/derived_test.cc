// Tests parameters tied to others by expressions.

#include <gmock/gmock.h>

#include <functional>

#include "core/estimator/problem/resolved_problem.h"
#include "tests/testing/oscillator.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

Problem TwoSprings() {
  Problem problem;
  problem.model = *FindBuiltinModel("roll_plane_2dof");
  problem.fixed = {{"M", 600}};
  problem.uncertain = {UncertainParameter::Uniform("k1", 10e3, 30e3).value(),
                       UncertainParameter::Uniform("L", 1, 2).value()};
  problem.derived = {{"k2", "1.5*k1"}, {"I", "M*(L/2)^2/3 + k2/1e4"}};
  problem.inputs = {{"u1", HalfSineBumpInput{}}};
  problem.measured = {{"x1", {.absolute = 1e-3}}};
  return problem;
}

std::string RefusalOf(const std::function<void(Problem&)>& change) {
  Problem problem = TwoSprings();
  change(problem);
  return std::string(ResolvedProblem::Make(std::move(problem)).status().message());
}

TEST(DerivedParameters, FollowTheParametersOfEachPoint) {
  const ResolvedProblem problem = ResolvedProblem::Make(TwoSprings()).value();
  Matrix thetas(2, 2);
  thetas << 12e3, 1.2, 20e3, 1.8;
  const EnsembleSpecification ensemble = problem.MakeEnsemble(thetas, {0}, 1);
  const ModelDescription& model = problem.problem().model->description();
  const int k2 = *model.FindParameter("k2");
  const int inertia = *model.FindParameter("I");
  for (int q = 0; q < 2; ++q) {
    EXPECT_DOUBLE_EQ(ensemble.parameters(q, k2), 1.5 * thetas(q, 0));
    EXPECT_DOUBLE_EQ(ensemble.parameters(q, inertia),
                     600 * thetas(q, 1) * thetas(q, 1) / 12 + 1.5e-4 * thetas(q, 0));
  }
}

TEST(DerivedParameters, MayUseAndBeChannelParameters) {
  Problem problem = TwoSprings();
  problem.derived = {{"x1.offset", "u1.delay/10 + u1.amplitude"}};
  problem.fixed["u1.delay"] = 0.5;
  problem.fixed["u1.amplitude"] = 2;
  const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
  const EnsembleSpecification ensemble =
      resolved.MakeEnsemble(Eigen::RowVector2d(2e4, 1.5), resolved.outputs(), 1);
  EXPECT_DOUBLE_EQ(ensemble.output_offsets(0, 0), 2.05);
}

// Such a point fails, and the others are treated as if it were not there.
TEST(DerivedParameters, ThatAreNoNumbersLeaveWhatAllPointsShareAsItIs) {
  Problem problem = TwoSprings();
  problem.derived["k2"] = "sqrt(k1 - 15e3)";
  const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
  Matrix thetas(2, 2);
  thetas << 12e3, 1.2, 20e3, 1.8;
  const EnsembleSpecification ensemble = resolved.MakeEnsemble(thetas, resolved.outputs(), 1);
  EXPECT_TRUE(ensemble.parameters.row(0).array().isNaN().all());
  EXPECT_TRUE(ensemble.parameters.row(1).allFinite());
  EXPECT_EQ(ensemble.input_delays_s.size(), 0);
  EXPECT_EQ(ensemble.output_delays_s.size(), 0);
  EXPECT_EQ(ensemble.output_gains.size(), 0);
}

TEST(DerivedParameters, AreRefusedWithTheirPlace) {
  EXPECT_THAT(RefusalOf([](Problem& p) { p.derived["k2"] = "1.5*k11"; }),
              HasSubstr("derived.k2: column 5"));
  EXPECT_THAT(RefusalOf([](Problem& p) { p.derived["k2"] = "I"; }), HasSubstr("derived."));
  EXPECT_THAT(RefusalOf([](Problem& p) { p.derived["stiffness"] = "k1"; }),
              HasSubstr("derived.stiffness: model roll_plane_2dof has no parameter"));
  EXPECT_EQ(RefusalOf([](Problem& p) { p.fixed["k2"] = 1; }),
            "derived.k2: k2 is both fixed and derived");
  EXPECT_EQ(RefusalOf([](Problem& p) { p.derived["k1"] = "k2"; }),
            "derived.k1: k1 is both uncertain and derived");
  EXPECT_EQ(RefusalOf([](Problem& p) { p.derived["u1.delay"] = "L"; }),
            "derived.u1.delay: a delay cannot be derived; derive others from it");
}

TEST(DerivedParameters, ThatAreNotFiniteAreAFailedTrajectory) {
  Problem problem = TwoSprings();
  problem.derived["k2"] = "sqrt(k1 - 4e4)";
  Samples record;
  record.time_s = {0.1, 0.2};
  record.columns = {{"x1", {0.01, 0.01}, {}}};
  const auto estimator = MakeEstimator(problem);
  ASSERT_TRUE(estimator->Append(record).ok());
  const absl::Status status = estimator->Process();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("only 0 of"));
}

// Both springs are tied. The sum of the forces tells one stiffness, but would leave two open.
TEST(DerivedParameters, TieWhatTheDataCannotTellApart) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"x0", 1}};
  problem.uncertain = {UncertainParameter::Uniform("m", 0.5, 1.5).value()};
  problem.derived = {{"k", "40*m"}, {"c", "0.1*m"}};
  problem.measured = {{"x", {.absolute = 0.01}}};
  Samples record;
  record.columns = {{"x", {}, {}}};
  for (int k = 1; k <= 100; ++k) {
    record.time_s.push_back(0.05 * k);
    record.columns[0].value.push_back(
        testing::OscillatorDisplacement(40, 0.1, record.time_s.back()));
  }
  // The motion depends on k/m and c/m alone, so that nothing is learned about m.
  const Estimate estimate = EstimateOf(problem, record);
  EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kNotIdentified);
  EXPECT_NEAR(estimate.channels[0].chi_squared, 0, 1e-6);
}

}  // namespace
}  // namespace polyest::internal
