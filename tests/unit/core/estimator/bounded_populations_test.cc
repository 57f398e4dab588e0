// Tests populations of precise runs whose parameter has a uniform prior. The model is linear in the
// parameter and curved in its normal score, so that each run divides the posterior into elements.
// The oracle is quadrature over every run's parameter and a grid of the population's.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>

#include "core/chaos/germ.h"
#include "tests/testing/population.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::bounded_populations {
namespace {

constexpr double kLower = 2, kUpper = 10;

// Runs y = v t + noise.
struct Campaign {
  double noise;
  int runs, rows;
  Samples samples;

  Campaign(double sigma, int run_count, int row_count, uint64_t seed)
      : noise(sigma), runs(run_count), rows(row_count) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    samples.columns = {{"y", {}, {}}};
    for (int run = 0; run < runs; ++run) {
      const double v = ParameterAt(0.3 + 0.7 * normal(generator));
      for (int i = 1; i <= rows; ++i) {
        const double t = 2.0 * i / rows;
        samples.run.push_back(run);
        samples.time_s.push_back(t);
        samples.columns[0].value.push_back(v * t + noise * normal(generator));
      }
    }
  }

  static double ParameterAt(double score) {
    return kLower + (kUpper - kLower) * Germ::Normal().CumulativeProbability(score);
  }

  Problem MakeProblem() const {
    UncertainParameter v = UncertainParameter::Uniform("v", kLower, kUpper).value();
    v.per_run = v.population = true;
    return TextProblem("v*t", {v}, noise);
  }
};

struct Oracle {
  Moments median, spread;

  explicit Oracle(const Campaign& campaign) {
    constexpr int kNodes = 41, kGrid = 120;
    Matrix scores(campaign.runs, kNodes), weights(campaign.runs, kNodes);
    for (int run = 0; run < campaign.runs; ++run) {
      double tt = 0, ty = 0;
      for (int i = campaign.rows * run; i < campaign.rows * (run + 1); ++i) {
        const double t = campaign.samples.time_s[static_cast<size_t>(i)];
        tt += t * t;
        ty += t * campaign.samples.columns[0].value[static_cast<size_t>(i)];
      }
      for (int k = 0; k < kNodes; ++k) {
        const double u = -5 + 10.0 * k / (kNodes - 1);
        const double v = ty / tt + u * campaign.noise / std::sqrt(tt);
        const double g = Germ::Normal().Quantile((v - kLower) / (kUpper - kLower));
        scores(run, k) = g;
        // dv = (upper − lower) φ(g) dg
        weights(run, k) = std::exp(-0.5 * u * u + 0.5 * g * g);
      }
    }
    for (int i = 0; i < kGrid; ++i) {
      for (int j = 0; j < kGrid; ++j) {
        const double m = -3 + 6 * (i + 0.5) / kGrid, log_s = -3 + 5 * (j + 0.5) / kGrid;
        const double s = std::exp(log_s);
        const Matrix densities =
            weights.array() * (-0.5 * ((scores.array() - m) / s).square()).exp() / s;
        const double log_density = densities.rowwise().sum().array().log().sum() - 0.5 * m * m -
                                   0.5 * std::pow(log_s - std::log(0.5), 2);
        median.Add(std::exp(log_density), Campaign::ParameterAt(m));
        spread.Add(std::exp(log_density), s);
      }
    }
  }
};

void ExpectMoments(const Estimate& estimate, const std::string& name, const Moments& exact) {
  SCOPED_TRACE(name);
  const ParameterEstimate& parameter =
      *std::ranges::find(estimate.parameters, name, &ParameterEstimate::name);
  EXPECT_NEAR(parameter.mean, exact.mean(), 0.1 * exact.deviation());
  EXPECT_NEAR(parameter.posterior_std_dev, exact.deviation(), 0.1 * exact.deviation());
}

// Without the parameter of an ended run its elements overlap. If each of them were divided again by
// the next run, the third run of this campaign would have moved 104 expansions.
TEST(BoundedPopulations, DivideTheRunsOfOnePosteriorAndNotOfEachElement) {
  const Campaign campaign(/*sigma=*/0.03, /*run_count=*/3, /*row_count=*/10, /*seed=*/3);
  const Estimate estimate = EstimateOf(campaign.MakeProblem(), campaign.samples);
  const Oracle exact(campaign);
  ExpectMoments(estimate, "v.median", exact.median);
  ExpectMoments(estimate, "v.spread", exact.spread);
  EXPECT_LT(estimate.expansion.reexpansions, 60);
}

}  // namespace
}  // namespace polyest::internal::bounded_populations
