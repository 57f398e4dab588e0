#include "core/bayes/markov_chains.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>

#include "core/bayes/posterior.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal {
namespace {

Prior OneUniform() { return Prior({UncertainParameter::Uniform("a", -1, 1).value()}); }

Chains RunOn(const Cost& cost, double bound, const ChainOptions& options = {}) {
  const int n = cost.dimension();
  const Vector upper = Vector::Constant(n, bound);
  const Particles particles = SamplePosterior(cost, -upper, upper, Matrix(0, n), {}, {}).value();
  return RunChains(cost, -upper, upper, particles, Matrix::Identity(n, n), options, {}).value();
}

struct Exact {
  double mean = 0;
  double std_dev = 0;
};

// Computes the moments of ξ of the normal a when of a ~ N(1, 0.2²) and b ~ N(1, 0.3²) only the
// product p > 0 is known, exactly, by the midpoint rule: the density of a is ρ_a(a) ρ_b(p/a)/|a|.
// The negative a, of 10⁻⁶ of the mass and less, are left out.
Exact OfKnownProduct(double p) {
  constexpr int kCells = 100'000;
  double weight = 0, first = 0, second = 0;
  for (int i = 0; i < kCells; ++i) {
    const double a = 3 * (i + 0.5) / kCells;
    const double xi = (a - 1) / 0.2, other = (p / a - 1) / 0.3;
    const double density = std::exp(-0.5 * (xi * xi + other * other)) / a;
    weight += density;
    first += density * xi;
    second += density * xi * xi;
  }
  return {first / weight, std::sqrt(second / weight - first * first / (weight * weight))};
}

// Computes the moments of the density e^{−J} on [−1, 1] by the midpoint rule.
Exact ByQuadrature(const Cost& cost) {
  constexpr int kCells = 20'000;
  double weight = 0, first = 0, second = 0;
  for (int i = 0; i < kCells; ++i) {
    const Vector xi = Vector::Constant(1, 2 * (i + 0.5) / kCells - 1);
    const double density = std::exp(-cost.Evaluate(xi).total);
    weight += density;
    first += density * xi[0];
    second += density * xi[0] * xi[0];
  }
  return {first / weight, std::sqrt(second / weight - first * first / (weight * weight))};
}

// Allows a mean four of its standard errors s/√N, with N the effective size.
void ExpectMean(const Chains& chains, const Exact& exact) {
  const double error = 4 * exact.std_dev / std::sqrt(chains.effective_size[0]);
  EXPECT_NEAR(chains.etas.col(0).mean(), exact.mean, error);
}

TEST(RunChains, AgreeWithQuadratureAtABound) {
  const Cost cost = CostOf(OneUniform(), {{[](const Vector& xi) { return xi[0]; }, 1.2, 0.3}});
  const Chains chains = RunOn(cost, 1.15);
  ExpectMean(chains, ByQuadrature(cost));
  EXPECT_GE(chains.effective_size[0], ChainOptions().effective_size);
  EXPECT_LT(chains.r_hat[0], 1.01);
  EXPECT_LE(chains.etas.maxCoeff(), 1);
}

// The posterior has two pieces, the right one seven times as heavy.
TEST(RunChains, WeighSeparatePieces) {
  const Cost cost =
      CostOf(OneUniform(), {{[](const Vector& xi) { return xi[0] * xi[0]; }, 0.36, 0.05},
                            {[](const Vector& xi) { return xi[0]; }, 0.5, 0.8}});
  const Chains chains = RunOn(cost, 1);
  ExpectMean(chains, ByQuadrature(cost));
  EXPECT_LT(chains.r_hat[0], 1.02);
}

// Of a and b, both between 1 and 9, only the product is known: the posterior is a hyperbola, 10⁻⁴
// as thick as it is long. There the density of a is ∝ 1/a, the thickness of the ridge along b.
TEST(RunChains, MixAlongAProductThatIsKnown) {
  const Prior prior({UncertainParameter::Uniform("a", 1, 9).value(),
                     UncertainParameter::Uniform("b", 1, 9).value()});
  const auto product = [](const Vector& xi) { return (5 + 4 * xi[0]) * (5 + 4 * xi[1]); };
  const Cost cost = CostOf(prior, {{product, 9, 0.003}});
  const Chains chains = RunOn(cost, 1);
  EXPECT_LT(chains.r_hat.maxCoeff(), 1.01);
  EXPECT_GE(chains.effective_size.minCoeff(), 5'000);  // in germ coordinates 600
  const double mean = 8 / std::log(9);
  const double std_dev = std::sqrt(40 / std::log(9) - mean * mean);
  ExpectMean(chains, {(mean - 5) / 4, std_dev / 4});
}

// So are normal ones, whose priors hold both signs: the valley is 3·10⁻⁴ as thick as it is long,
// and less. The standard deviation has the standard error s √((κ − 1)/4N), with the kurtosis κ < 4.
TEST(RunChains, MixAlongAProductOfNormalParametersThatIsKnown) {
  const Prior prior({UncertainParameter::Normal("a", 1, 0.2).value(),
                     UncertainParameter::Normal("b", 1, 0.3).value()});
  const auto product = [](const Vector& xi) { return (1 + 0.2 * xi[0]) * (1 + 0.3 * xi[1]); };
  for (const double noise : {1e-4, 5e-5, 1e-6}) {
    const Chains chains = RunOn(CostOf(prior, {{product, 1.113, noise}}), 8);
    EXPECT_LT(chains.r_hat.maxCoeff(), 1.01);
    const Exact exact = OfKnownProduct(1.113);
    ExpectMean(chains, exact);
    const Vector a = chains.etas.col(0);
    const double std_dev = std::sqrt((a.array() - a.mean()).square().mean());
    const double error = 4 * std::sqrt(0.75 / chains.effective_size[0]);
    EXPECT_NEAR(std_dev / exact.std_dev, 1, error) << noise;
  }
}

// With standard normal a and b the valley has two branches that are alike, a, b > 0 and a, b < 0.
// Chains mix along each: |a| has the density ∝ e^{−(a² + 1/a²)/2}/a.
TEST(RunChains, MixAlongBothBranchesOfAProductThatIsKnown) {
  const Prior prior({UncertainParameter::Normal("a", 0, 1).value(),
                     UncertainParameter::Normal("b", 0, 1).value()});
  const auto product = [](const Vector& xi) { return xi[0] * xi[1]; };
  const Chains chains = RunOn(CostOf(prior, {{product, 1, 1e-4}}), 8);
  const Vector magnitudes = chains.etas.col(0).cwiseAbs();
  constexpr int kCells = 100'000;
  double weight = 0, first = 0, second = 0;
  for (int i = 0; i < kCells; ++i) {
    const double a = 8 * (i + 0.5) / kCells;
    const double density = std::exp(-0.5 * (a * a + 1 / (a * a))) / a;
    weight += density;
    first += density * a;
    second += density * a * a;
  }
  const double mean = first / weight;
  const double std_dev = std::sqrt(second / weight - mean * mean);
  const double error = 4 / std::sqrt(chains.effective_size.minCoeff());
  EXPECT_NEAR(magnitudes.mean(), mean, error * std_dev);
  const double found = std::sqrt((magnitudes.array() - magnitudes.mean()).square().mean());
  EXPECT_NEAR(found / std_dev, 1, error);  // the kurtosis is below 5
}

// The pieces are so far apart and so narrow that no chain jumps between them. Each group of chains
// has a piece of its own.
TEST(RunChains, SayThatGroupsNeverMet) {
  const Cost cost =
      CostOf(OneUniform(), {{[](const Vector& xi) { return xi[0] * xi[0]; }, 0.36, 1e-4}});
  Particles particles{Matrix::Constant(80, 1, 0.6), Vector::Zero(80)};
  particles.etas.topRows(40) *= -1;
  particles.etas += 1e-5 * Matrix::Random(80, 1);
  for (Eigen::Index i = 0; i < 80; ++i) {
    particles.costs[i] = cost.Evaluate(particles.etas.row(i).transpose()).total;
  }
  const Vector upper = Vector::Ones(1);
  const Chains chains =
      RunChains(cost, -upper, upper, particles, Matrix::Ones(1, 1), {}, {}).value();
  EXPECT_GT(chains.r_hat[0], 1.5);
  EXPECT_LT(chains.effective_size[0], 200);
}

TEST(RunChains, KeepCostsWithTheirDraws) {
  const Cost cost = CostOf(OneUniform(), {{[](const Vector& xi) { return xi[0]; }, 0.4, 0.2}});
  ChainOptions options;
  options.effective_size = 1e9;  // never reached: as many sweeps as allowed, and draws thinned
  options.max_sweeps = 300;
  const Chains chains = RunOn(cost, 1.15, options);
  ASSERT_EQ(chains.etas.rows(), chains.costs.size());
  EXPECT_EQ(chains.etas.rows() % 1000, 0);
  for (Eigen::Index i = 0; i < chains.etas.rows(); i += 97) {
    EXPECT_NEAR(chains.costs[i], cost.Evaluate(chains.etas.row(i).transpose()).total, 1e-9);
  }
}

TEST(RunChains, AreAFunctionOfTheirArgumentsAlone) {
  const Cost cost = CostOf(OneUniform(), {{[](const Vector& xi) { return xi[0]; }, 0.4, 0.2}});
  EXPECT_EQ(RunOn(cost, 1.15).etas, RunOn(cost, 1.15).etas);
}

TEST(RunChains, AreCancelledByAStopRequest) {
  const Cost cost = CostOf(OneUniform(), {});
  std::stop_source source;
  source.request_stop();
  const Vector upper = Vector::Ones(1);
  const auto chains = RunChains(cost, -upper, upper, {Matrix::Random(80, 1), Vector::Zero(80)},
                                Matrix::Ones(1, 1), {}, Stop(source.get_token()));
  EXPECT_EQ(chains.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace polyest::internal
