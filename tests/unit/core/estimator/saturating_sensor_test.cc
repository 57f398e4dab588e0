// Estimates of a process that noise drives and that a saturating sensor sees. The oracle is the
// posterior by quadrature over the likelihood of a filter on a grid
// (tests/unit/core/propagation/grid_filter.h).

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "polyest/equation_model.h"
#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/propagation/grid_filter.h"

namespace polyest::internal::saturating_sensor_test {
namespace {

constexpr double kDrive = 0.6, kDiffusion = 0.3, kSigma = 0.05;

Problem Relaxation(const char* output) {
  Problem problem;
  problem.model =
      MakeEquationModel(
          {.states = {{"x", "0.6 - a*x"}}, .outputs = {{"y", output}}, .parameters = {{"a", 1}}})
          .value();
  problem.uncertain = {UncertainParameter::Lognormal("a", 1, 0.5).value()};
  problem.fixed = {{"x_0", 0}};
  problem.measured = {{"y", {.absolute = kSigma}}};
  problem.process_noise = {{.state = "x", .spectral_density = kDiffusion}};
  return problem;
}

struct Moments {
  double mean = 0, deviation = 0;
};

// Posterior of a by the trapezoidal rule in log a over 6 standard deviations of the prior, whose
// variance there is log 1.25.
Moments Posterior(const OrnsteinUhlenbeckRecord& record, double (*h)(double)) {
  constexpr int kNodes = 41;
  const double variance = std::log(1.25);
  double sum = 0, mean = 0, square = 0, first = 0;
  for (int i = 0; i < kNodes; ++i) {
    const double score = -2.5 + 5.0 * i / (kNodes - 1);
    const double a = std::exp(score * std::sqrt(variance) - variance / 2);
    const double log = FilterOnGrid({a, kDrive, kDiffusion, 0}, h, record, kSigma).log_likelihood -
                       score * score / 2;
    if (i == 0) first = log;
    const double weight = std::exp(log - first);
    sum += weight;
    mean += weight * a;
    square += weight * a * a;
  }
  mean /= sum;
  return {mean, std::sqrt(square / sum - mean * mean)};
}

// The states' density is not normal, which leaves a few hundredths of a standard deviation; the
// expansion may add a tenth. With the Gaussian filter's own likelihood the mean was off by 1.7.
void ExpectPosterior(const char* output, double (*h)(double)) {
  const OrnsteinUhlenbeckRecord record =
      MakeRecord({1.3, kDrive, kDiffusion, 0}, h, 0.3, 60, kSigma, 3);
  Samples samples;
  samples.time_s = record.times_s;
  samples.columns = {{"y", record.values, {}}};
  const Moments exact = Posterior(record, h);
  const Estimate estimate = EstimateOf(Relaxation(output), samples);
  const ParameterEstimate& a = estimate.parameters[0];
  EXPECT_NEAR(a.mean, exact.mean, 0.15 * exact.deviation);
  EXPECT_NEAR(a.posterior_std_dev, exact.deviation, 0.1 * exact.deviation);
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kExpansionInaccurate))
      << Message(estimate, DiagnosticCode::kExpansionInaccurate);
}

TEST(SaturatingSensor, TellsWhatTheExactLikelihoodTells) {
  ExpectPosterior("tanh(2*x)", [](double x) { return std::tanh(2 * x); });
}

TEST(SaturatingSensor, TellsAsMuchAsOneThatGrowsExponentially) {
  ExpectPosterior("exp(x)", [](double x) { return std::exp(x); });
}

}  // namespace
}  // namespace polyest::internal::saturating_sensor_test
