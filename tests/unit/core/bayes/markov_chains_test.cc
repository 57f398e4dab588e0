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
