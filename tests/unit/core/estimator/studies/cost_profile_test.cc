#include "core/estimator/studies/cost_profile.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::cost_profile_test {
namespace {

UncertainParameter Normal(const char* name) {
  return UncertainParameter::Normal(name, 0, 1).value();
}

// The oracle is a Gaussian posterior with covariance C: J_p − min J = ½ (θ_i − θ̂_i)²/C_ii, and the
// others are at θ̂_j + C_ij/C_ii (θ_i − θ̂_i).
TEST(CostProfile, OfALinearProblemIsTheParabolaOfTheMarginalVariance) {
  const double noise = 0.3, z = 1.5;
  const auto estimator =
      Processed(TextProblem("a + 2*b - c", {Normal("a"), Normal("b"), Normal("c")}, noise), {z});
  const Eigen::Vector3d h(1, 2, -1);
  const Eigen::Matrix3d covariance =
      (Eigen::Matrix3d::Identity() + h * h.transpose() / (noise * noise)).inverse();
  const Eigen::Vector3d map = covariance * h * z / (noise * noise);
  ProfileOptions options;
  options.points = 9;
  const CostProfiles profiles = estimator->CurrentProfiles(options).value();
  ASSERT_EQ(profiles.profiles.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    const CostProfile& profile = profiles.profiles[static_cast<size_t>(i)];
    SCOPED_TRACE(profile.parameter);
    EXPECT_NEAR(profiles.map[i], map[i], 1e-6);
    ASSERT_EQ(profile.value.size(), 9);
    EXPECT_LT(profile.value[0], map[i] - 2 * std::sqrt(covariance(i, i)));
    EXPECT_GT(profile.value[8], map[i] + 2 * std::sqrt(covariance(i, i)));
    for (int k = 0; k < 9; ++k) {
      const double off = profile.value[k] - map[i];
      EXPECT_NEAR(profile.total[k] - profiles.least.total, off * off / covariance(i, i) / 2, 1e-6);
      EXPECT_NEAR(profile.total[k], profile.mismatch[k] + profile.prior[k], 1e-9);
      EXPECT_TRUE(profile.converged[static_cast<size_t>(k)]);
      EXPECT_NEAR(profile.at(k, i), profile.value[k], 1e-9);
      for (int j = 0; j < 3; ++j) {
        EXPECT_NEAR(profile.at(k, j), map[j] + covariance(i, j) / covariance(i, i) * off, 1e-5);
      }
    }
  }
}

// The data measure only the sum: the profile of the mismatch is flat, and the other parameter makes
// up for the change.
TEST(CostProfile, IsFlatWhereParametersTradeOff) {
  const auto uniform = [](const char* name) {
    return UncertainParameter::Uniform(name, -1, 1).value();
  };
  const auto estimator = Processed(TextProblem("a + b", {uniform("a"), uniform("b")}, 0.01), {0.2});
  ProfileOptions options;
  options.parameters = {"b"};
  const CostProfiles profiles = estimator->CurrentProfiles(options).value();
  ASSERT_EQ(profiles.profiles.size(), 1u);
  const CostProfile& profile = profiles.profiles.front();
  EXPECT_EQ(profile.parameter, "b");
  // The sum a + b = 0.2 with a ≤ 1 allows b from −0.8 to 1.
  for (Eigen::Index k = 0; k < profile.value.size(); ++k) {
    if (profile.value[k] < -0.79) continue;
    EXPECT_NEAR(profile.mismatch[k], 0, 1e-6);
    EXPECT_NEAR(profile.at(k, 0), 0.2 - profile.value[k], 1e-5);
  }
  EXPECT_GE(profile.value.minCoeff(), -1);
  EXPECT_LE(profile.value.maxCoeff(), 1);
  EXPECT_GT(profile.value.maxCoeff(), 0.95);
}

// The data ask for a larger b than its prior allows: the profile starts at the bound, with the best
// a for it.
TEST(CostProfile, StartsAtABoundOfThePrior) {
  const auto uniform = [](const char* name) {
    return UncertainParameter::Uniform(name, -1, 1).value();
  };
  Problem problem = TextProblem("a + b", {uniform("a"), uniform("b")}, 0.1);
  EquationSpecification equations;
  equations.outputs = {{"y", "a + b"}, {"w", "b"}};
  problem.model = MakeEquationModel(equations).value();
  problem.measured.push_back({"w", {.absolute = 0.1}});
  Samples samples;
  samples.time_s = {1};
  samples.columns = {{"y", {0.7}, {}}, {"w", {1.1}, {}}};
  const auto estimator = MakeEstimator(problem);
  ASSERT_TRUE(estimator->Append(samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  ProfileOptions options;
  options.parameters = {"b"};
  const CostProfiles profiles = estimator->CurrentProfiles(options).value();
  const CostProfile& profile = profiles.profiles.front();
  ASSERT_GT(profile.value.size(), 10);
  EXPECT_NEAR(profile.value[profile.value.size() - 1], 1, 1e-6);
  for (Eigen::Index k = 0; k < profile.value.size(); ++k) {
    const double b = profile.value[k];
    // The other parameter is free to take the exact a = 0.7 − b.
    EXPECT_NEAR(profile.mismatch[k], std::pow((1.1 - b) / 0.1, 2) / 2, 1e-6);
    EXPECT_NEAR(profile.at(k, 0), 0.7 - b, 1e-5);
  }
}

TEST(CostProfile, OfOneParameterIsTheCostItself) {
  const auto estimator = Processed(TextProblem("a^2", {Normal("a")}, 0.1), {0.5});
  const CostProfiles profiles = estimator->CurrentProfiles({}).value();
  const CostProfile& profile = profiles.profiles.front();
  for (Eigen::Index k = 0; k < profile.value.size(); ++k) {
    const double a = profile.value[k];
    EXPECT_NEAR(profile.mismatch[k], std::pow((0.5 - a * a) / 0.1, 2) / 2,
                1e-9 * (1 + profile.mismatch[k]));
  }
  // The profile contains both minima.
  EXPECT_LT(profile.value[0], -0.7);
  EXPECT_GT(profile.value[profile.value.size() - 1], 0.7);
}

TEST(ProfileOptions, NameFieldValueAndRule) {
  const Prior prior({Normal("a"), Normal("b")});
  ProfileOptions options;
  EXPECT_TRUE(Validate(options, prior).ok());
  options.parameters = {"a", "c"};
  EXPECT_EQ(Validate(options, prior).message(),
            "parameters[1]: \"c\" is not among the uncertain parameters a, b");
  options = {};
  options.points = 2;
  EXPECT_EQ(Validate(options, prior).message(), "points: 2 must be from 3 to 1001");
}

}  // namespace
}  // namespace polyest::internal::cost_profile_test
