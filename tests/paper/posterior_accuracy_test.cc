// Tests how near means, standard deviations and 95 % limits of the posterior come to those of the
// exact model: within 3 % of a posterior standard deviation, for five problems of different shapes.
// The oracle is e^{−J} on a fine grid over the prior's domain, with J from closed forms of the
// model. For one or two unknowns it is more exact than any Markov chain on the exact model, and it
// has no sampling error of its own.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <ostream>
#include <vector>

#include "core/model/equations/equation_model.h"
#include "polyest/catalogue.h"
#include "polyest/estimator.h"
#include "tests/testing/oscillator.h"

namespace polyest::internal {
namespace {

using testing::OscillatorDisplacement;
using testing::OscillatorProblem;

struct Summary {
  double mean = 0;
  double std_dev = 0;
  double lower95 = 0;
  double upper95 = 0;
};

struct Domain {
  Vector lower, upper;  // The density beyond them is negligible or 0.
};

struct Case {
  const char* name;
  Problem problem;
  Samples samples;
  Domain domain;
  std::function<double(const Vector& theta)> cost;  // −log density, up to a constant
  PosteriorMethod method;
  bool gaussian;  // Otherwise NON_GAUSSIAN is reported.
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

// Summarizes one marginal, given by its probabilities in cells of equal width.
Summary SummaryOf(const Vector& mass, double lower, double width) {
  const double all = mass.sum();
  const auto at = [&](double cell) { return lower + (cell + 0.5) * width; };
  const auto quantile = [&](double probability) {
    double below = 0;
    for (Eigen::Index i = 0;; ++i) {
      const double next = below + mass[i] / all;
      if (next >= probability) {
        return at(static_cast<double>(i) - 0.5 + (probability - below) / (next - below));
      }
      below = next;
    }
  };
  Summary summary;
  for (Eigen::Index i = 0; i < mass.size(); ++i) {
    summary.mean += mass[i] / all * at(static_cast<double>(i));
  }
  for (Eigen::Index i = 0; i < mass.size(); ++i) {
    const double difference = at(static_cast<double>(i)) - summary.mean;
    summary.std_dev += mass[i] / all * difference * difference;
  }
  summary.std_dev = std::sqrt(summary.std_dev);
  summary.lower95 = quantile(0.025);
  summary.upper95 = quantile(0.975);
  return summary;
}

// Integrates by the midpoint rule with at least ten cells per standard deviation of the cases
// below. The error is of the order of (1/10)²/24 of a standard deviation.
std::vector<Summary> ByQuadrature(const Case& one) {
  const Eigen::Index n = one.domain.lower.size();
  const Eigen::Index cells = n == 1 ? 200'000 : 600;
  const Vector width = (one.domain.upper - one.domain.lower) / static_cast<double>(cells);
  Matrix cost(cells, n == 1 ? 1 : cells);
  Vector theta(n);
  for (Eigen::Index i = 0; i < cost.rows(); ++i) {
    for (Eigen::Index j = 0; j < cost.cols(); ++j) {
      theta[0] = one.domain.lower[0] + (static_cast<double>(i) + 0.5) * width[0];
      if (n == 2) theta[1] = one.domain.lower[1] + (static_cast<double>(j) + 0.5) * width[1];
      cost(i, j) = one.cost(theta);
    }
  }
  const Matrix density = (cost.minCoeff() - cost.array()).exp();
  std::vector<Summary> summaries = {
      SummaryOf(density.rowwise().sum(), one.domain.lower[0], width[0])};
  if (n == 2) {
    summaries.push_back(
        SummaryOf(density.colwise().sum().transpose(), one.domain.lower[1], width[1]));
  }
  return summaries;
}

Problem TextProblem(const char* output, std::vector<UncertainParameter> uncertain, double noise) {
  Problem problem;
  EquationSpecification equations;
  equations.outputs = {{"y", output}};
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = std::move(uncertain);
  problem.measured = {{"y", {.absolute = noise}}};
  return problem;
}

Samples Record(const char* output, const std::vector<double>& values) {
  Samples samples;
  samples.columns = {{output, values, {}}};
  for (size_t i = 0; i < values.size(); ++i) samples.time_s.push_back(static_cast<double>(i + 1));
  return samples;
}

// Returns ½ Σ ((z − y)/σ)².
double Mismatch(const std::vector<double>& values, double y, double noise) {
  double sum = 0;
  for (const double z : values) sum += 0.5 * std::pow((z - y) / noise, 2);
  return sum;
}

Vector V(std::initializer_list<double> values) {
  return Eigen::Map<const Vector>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

// The frequency ω = √(k/m) is measured to 25 %; the stiffness varies with its square.
Case Skewed() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_frequency");
  problem.fixed = {{"m", 1}};
  problem.uncertain = {*UncertainParameter::Uniform("k", 1, 100)};
  const double noise = 1.2;
  problem.measured = {{"omega", {.absolute = noise}}};
  problem.expansion.order = 8;
  const std::vector<double> values = {4.5, 5.1};
  return {"skewed",
          problem,
          Record("omega", values),
          {V({1}), V({100})},
          [=](const Vector& theta) { return Mismatch(values, std::sqrt(theta[0]), noise); },
          PosteriorMethod::kImportanceSampling,
          true};
}

Samples OscillatorSamples(double c, double duration_s) {
  Samples samples;
  samples.columns = {{"x", {}, {}}};
  for (double t = 0.05; t < duration_s; t += 0.05) {
    samples.time_s.push_back(t);
    samples.columns[0].value.push_back(OscillatorDisplacement(40, c, t));
  }
  return samples;
}

double OscillatorCost(const Samples& samples, const Vector& theta) {
  double sum = 0;
  for (size_t i = 0; i < samples.rows(); ++i) {
    const double x = OscillatorDisplacement(theta[0], theta[1], samples.time_s[i]);
    sum += 0.5 * std::pow((samples.columns[0].value[i] - x) / testing::kOscillatorNoise, 2);
  }
  return sum;
}

// The data ask for a damping of 0.098 N s/m, which is below the prior's 0.1 … 0.3.
Case AtABound() {
  const Samples samples = OscillatorSamples(0.098, 3);
  return {"atABound",
          OscillatorProblem(5),
          samples,
          {V({39.6, 0.1}), V({40.4, 0.16})},
          [=](const Vector& theta) { return OscillatorCost(samples, theta); },
          PosteriorMethod::kImportanceSampling,
          false};
}

Case Gaussian() {
  const Samples samples = OscillatorSamples(0.2, 5);
  return {"gaussian",
          OscillatorProblem(5),
          samples,
          {V({39.7, 0.16}), V({40.3, 0.24})},
          [=](const Vector& theta) { return OscillatorCost(samples, theta); },
          PosteriorMethod::kImportanceSampling,
          true};
}

// The data measure b − a², so that the posterior lies along a parabola.
Case Banana() {
  const double noise = 0.3;
  const std::vector<double> values = {0.1, -0.2};
  return {"banana",
          TextProblem(
              "b - a^2",
              {*UncertainParameter::Normal("a", 0.2, 1), *UncertainParameter::Normal("b", 0, 2)},
              noise),
          Record("y", values),
          {V({-3.5, -2}), V({3.5, 8})},
          [=](const Vector& theta) {
            return Mismatch(values, theta[1] - theta[0] * theta[0], noise) +
                   0.5 * std::pow(theta[0] - 0.2, 2) + 0.5 * std::pow(theta[1] / 2, 2);
          },
          PosteriorMethod::kImportanceSampling,
          false};
}

// The data measure a²: the posterior has two pieces, which the prior weighs unequally.
Case Bimodal() {
  const double noise = 0.05;
  const std::vector<double> values = {0.36, 0.41};
  return {"bimodal",
          TextProblem("a^2", {*UncertainParameter::Normal("a", 0.15, 0.7)}, noise),
          Record("y", values),
          {V({-2}), V({2})},
          [=](const Vector& theta) {
            return Mismatch(values, theta[0] * theta[0], noise) +
                   0.5 * std::pow((theta[0] - 0.15) / 0.7, 2);
          },
          PosteriorMethod::kImportanceSampling,
          false};
}

class PosteriorAccuracy : public ::testing::TestWithParam<Case> {};

void ExpectNear(const Summary& summary, const Summary& exact, double max_limit_error) {
  constexpr double kMaxError = 0.03;
  EXPECT_NEAR((summary.mean - exact.mean) / exact.std_dev, 0, kMaxError);
  EXPECT_NEAR((summary.std_dev - exact.std_dev) / exact.std_dev, 0, kMaxError);
  EXPECT_NEAR((summary.lower95 - exact.lower95) / exact.std_dev, 0, max_limit_error);
  EXPECT_NEAR((summary.upper95 - exact.upper95) / exact.std_dev, 0, max_limit_error);
}

// Returns the largest allowed error of a limit. An estimate is made of fewer draws than a study.
// From N draws, a limit at the probability p of a density f has the error √(p(1 − p)/N)/f. In the
// long tails here f is about 0.02/s (s is the standard deviation). Chains of 30,000 effective draws
// have 4,000 in the tails where they mix worst, which leaves an error of 0.12 s.
double MaxLimitErrorOfEstimates(PosteriorMethod method) {
  return method == PosteriorMethod::kImportanceSampling ? 0.03 : 0.12;
}

TEST_P(PosteriorAccuracy, IsThreePercentOfAStandardDeviation) {
  const Case& one = GetParam();
  const auto estimator = Estimator::Make(one.problem).value();
  Samples samples = one.samples;
  samples.end_of_run = true;
  ASSERT_TRUE(estimator->Append(samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  const std::vector<Summary> exact = ByQuadrature(one);
  const Posterior posterior = estimator->CurrentPosterior({}).value();
  EXPECT_EQ(posterior.method, one.method);
  const Estimate estimate = estimator->CurrentEstimate().value();
  for (size_t i = 0; i < exact.size(); ++i) {
    const PosteriorMarginal& marginal = posterior.marginals[i];
    SCOPED_TRACE(marginal.parameter);
    ExpectNear({marginal.mean, marginal.std_dev, marginal.quantiles[0], marginal.quantiles[2]},
               exact[i], 0.03);
    EXPECT_LT(marginal.r_hat, 1.01);
    const ParameterEstimate& parameter = estimate.parameters[i];
    ExpectNear({parameter.mean, parameter.posterior_std_dev, parameter.lower95, parameter.upper95},
               exact[i], MaxLimitErrorOfEstimates(one.method));
  }
  bool said = false;
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    said = said || diagnostic.code == DiagnosticCode::kNonGaussian;
  }
  EXPECT_NE(said, one.gaussian);
}

INSTANTIATE_TEST_SUITE_P(FiveShapes, PosteriorAccuracy,
                         ::testing::Values(Gaussian(), Skewed(), AtABound(), Banana(), Bimodal()));

}  // namespace
}  // namespace polyest::internal
