// Compares what the prior predicts through the expansion with Monte Carlo on the model itself.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/estimator/studies/prior_propagation.h"
#include "polyest/catalogue.h"

namespace polyest::internal {
namespace {

constexpr int kRuns = 20'000;
constexpr double kErrors = 4;  // standard errors allowed

// Draws θ from the prior kRuns times, kRuns × n.
Matrix DrawParameters(const Prior& prior) {
  std::mt19937_64 engine(1);
  Matrix thetas(kRuns, prior.dimension());
  Vector xi(prior.dimension());
  for (int r = 0; r < kRuns; ++r) {
    for (int i = 0; i < prior.dimension(); ++i) {
      const double u = (static_cast<double>(engine() >> 11) + 0.5) * 0x1p-53;
      xi(i) = Germ(prior.parameters()[i].germ).Quantile(u);
    }
    thetas.row(r) = prior.ToParameters(xi).transpose();
  }
  return thetas;
}

// Compares one output at one time over all runs with what the expansion predicts for it.
void ExpectAgreement(std::vector<double> runs, const PropagatedOutput& predicted, int k,
                     const std::vector<double>& probabilities) {
  const double n = kRuns;
  double mean = 0;
  for (double y : runs) mean += y / n;
  double second = 0, fourth = 0;
  for (double y : runs) {
    const double d = (y - mean) * (y - mean);
    second += d / n;
    fourth += d * d / n;
  }
  const double std_dev = std::sqrt(second);
  const double mean_error = std_dev / std::sqrt(n);
  // The variance of s² is Var(s²) ≈ (μ₄ − σ⁴)/n. The error of s = √s² is half its root over σ.
  const double std_dev_error = std::sqrt((fourth - second * second) / n) / (2 * std_dev);
  ASSERT_LT(predicted.residual(k), mean_error) << "the expansion must be finer than the oracle";
  EXPECT_NEAR(predicted.mean(k), mean, kErrors * mean_error);
  EXPECT_NEAR(predicted.std_dev(k), std_dev, kErrors * std_dev_error);
  // The number of runs below the p-quantile is binomial, so that the quantile lies between the
  // order statistics of rank n p ± 4 √(n p (1 − p)).
  std::sort(runs.begin(), runs.end());
  for (size_t q = 0; q < probabilities.size(); ++q) {
    const double p = probabilities[q], spread = kErrors * std::sqrt(n * p * (1 - p));
    const double quantile = predicted.quantiles(k, static_cast<Eigen::Index>(q));
    EXPECT_GE(quantile, runs[static_cast<size_t>(std::floor(n * p - spread))]) << "p = " << p;
    EXPECT_LE(quantile, runs[static_cast<size_t>(std::ceil(n * p + spread))]) << "p = " << p;
  }
}

void ExpectPropagationIsMonteCarlo(Problem problem, const std::vector<std::string>& outputs,
                                   double until_s, double step_s) {
  auto resolved = ResolvedProblem::Make(std::move(problem));
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  PropagationOptions options;
  options.until_s = until_s;
  options.step_s = step_s;
  options.outputs = outputs;
  // The draws of the expansion are many, so that their quantiles are finer than the oracle's.
  options.density_samples = 200'000;
  const auto propagation = PropagatePrior(*resolved, options, {});
  ASSERT_TRUE(propagation.ok()) << propagation.status();
  ASSERT_EQ(propagation->outputs.size(), outputs.size());

  std::vector<int> columns;
  for (const std::string& output : outputs) {
    columns.push_back(*resolved->problem().model->description().FindOutput(output));
  }
  const InputSignals inputs = resolved->MakeInputs();
  EnsemblePropagator model(resolved->MakeEnsemble(DrawParameters(resolved->prior()), columns, 2),
                           &inputs);
  const Eigen::Index m = static_cast<Eigen::Index>(columns.size());
  Matrix values(kRuns, m * static_cast<Eigen::Index>(propagation->time_s.size()));
  ASSERT_TRUE(model.Advance(propagation->time_s, values, {}).ok());
  ASSERT_TRUE(model.failures().empty());
  // The loop starts at 1 because nothing is uncertain yet at t = 0.
  for (size_t k = 1; k < propagation->time_s.size(); ++k) {
    for (Eigen::Index j = 0; j < m; ++j) {
      SCOPED_TRACE(propagation->outputs[j].output + " at " +
                   std::to_string(propagation->time_s[k]) + " s");
      const auto column = values.col(static_cast<Eigen::Index>(k) * m + j);
      ExpectAgreement({column.begin(), column.end()}, propagation->outputs[j], static_cast<int>(k),
                      options.probabilities);
    }
  }
}

TEST(PropagatePrior, IsMonteCarloForADampedOscillator) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1.0}, {"x0", 1.0}};
  problem.uncertain = {*UncertainParameter::Uniform("k", 31.58, 47.37),
                       *UncertainParameter::Normal("c", 0.4, 0.06)};
  problem.expansion.order = 8;
  problem.expansion.adaptive = false;
  ExpectPropagationIsMonteCarlo(problem, {"x", "v"}, 2, 0.25);
}

TEST(PropagatePrior, IsMonteCarloForADuffingOscillator) {
  Problem problem;
  problem.model = *FindBuiltinModel("duffing");
  problem.fixed = {{"x0", 1.0}, {"c", 0.1}};
  problem.uncertain = {*UncertainParameter::Uniform("k3", 0.5, 1.5),
                       *UncertainParameter::Beta("k", 2, 3, 0.6, 1.4)};
  problem.inputs = {{"force", SinusoidInput{.amplitude = 0.5, .frequency_hz = 0.3}}};
  problem.expansion.order = 8;
  problem.expansion.adaptive = false;
  ExpectPropagationIsMonteCarlo(problem, {"x", "v"}, 4, 0.5);
}

}  // namespace
}  // namespace polyest::internal
