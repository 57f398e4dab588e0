#include "core/estimator/problem/logarithmic_germs.h"

#include <gtest/gtest.h>

#include "core/bayes/prior.h"

namespace polyest::internal::logarithmic_germs_test {
namespace {

UncertainParameter Uniform(const char* name, double lower, double upper) {
  return UncertainParameter::Uniform(name, lower, upper).value();
}
UncertainParameter Lognormal(const char* name) {
  return UncertainParameter::Lognormal(name, 2, 1).value();
}

bool HasChanged(const UncertainParameter& before, const std::vector<UncertainParameter>& others,
                const std::vector<Correlation>& correlations = {}) {
  std::vector<UncertainParameter> all = others;
  all.push_back(before);
  const UncertainParameter after = ByLogarithms(all, correlations).back();
  EXPECT_EQ(after.name, before.name);
  return after.germ.family != before.germ.family;
}

TEST(LogarithmicGerms, LeaveTheDistributionAsItIs) {
  for (const auto& [lower, upper] : {std::pair{1.0, 9.0}, {3.0, 3.001}, {1e-3, 10.0}}) {
    const UncertainParameter before = Uniform("k", lower, upper);
    const UncertainParameter after = ByLogarithms({Lognormal("m"), before}, {}).back();
    ASSERT_EQ(after.germ.family, GermFamily::kExponential);
    EXPECT_NEAR(after.Mean(), before.Mean(), 1e-12 * upper);
    EXPECT_NEAR(after.StandardDeviation(), before.StandardDeviation(), 1e-12 * upper);
    const Germ germ(after.germ), uniform(before.germ);
    for (const double p : {1e-9, 0.1, 0.5, 0.8, 1 - 1e-9}) {
      EXPECT_NEAR(after.ToParameter(germ.Quantile(p)), before.ToParameter(uniform.Quantile(p)),
                  1e-12 * upper);
    }
  }
}

TEST(LogarithmicGerms, AreForUniformParametersBesideLogarithmicOnesOnly) {
  const UncertainParameter k = Uniform("k", 20, 60);
  EXPECT_TRUE(HasChanged(k, {Lognormal("m")}));
  EXPECT_TRUE(HasChanged(k, {UncertainParameter::LogUniform("m", 1, 2).value()}));
  EXPECT_FALSE(HasChanged(k, {Uniform("m", 1, 2)}));
  for (const char* name : {"x.noise", "c.drift", "processNoise.v"}) {
    EXPECT_FALSE(HasChanged(k, {Lognormal(name)})) << name;
  }
  EXPECT_FALSE(HasChanged(Uniform("k", 0, 60), {Lognormal("m")}));
  EXPECT_FALSE(HasChanged(Uniform("k", 1e-4, 60), {Lognormal("m")}));
  EXPECT_FALSE(HasChanged(k, {Lognormal("m")}, {{"m", "k", 0.5}}));
  EXPECT_FALSE(HasChanged(UncertainParameter::Normal("k", 40, 1).value(), {Lognormal("m")}));
}

// Where no data tell of it, every value of a uniform parameter is as probable.
TEST(LogarithmicGerms, KeepTheModesOfUniformParameters) {
  const Prior prior(ByLogarithms({Lognormal("m"), Uniform("k", 20, 60)}, {}));
  ASSERT_TRUE(prior.has_exponential_germs());
  const Prior modes = prior.WithModesOfUniform();
  EXPECT_EQ(modes.Gradient(Vector{{0.3, 0.9}})[1], 0);
  EXPECT_EQ(modes.ToParameters(Vector{{0.3, 0.9}}), prior.ToParameters(Vector{{0.3, 0.9}}));
  EXPECT_GT(prior.NegativeLogDensity(Vector{{0.3, -0.9}}),
            prior.NegativeLogDensity(Vector{{0.3, 0.9}}));
}

}  // namespace
}  // namespace polyest::internal::logarithmic_germs_test
