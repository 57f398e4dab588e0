// Tests posteriors of few samples whose noise has outliers. Each sample's likelihood is that of the
// noise's own density, and the oracle is the quadrature of their product with the prior.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "core/bayes/noise.h"
#include "core/common/types.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::few_robust_samples_test {
namespace {

// An expression of a and b at the time t.
using Output = std::function<double(double a, double b, double t)>;

struct Record {
  std::vector<double> values;  // at t = 1, 2, …
  double noise = 0.2;
  OutlierHandling outliers = OutlierHandling::kStudentT;
};

struct Exact {
  Vector mean, std_dev;
  Vector kurtosis;  // 3 for a normal density
};

// Integrates over a box. The grid is made twice, the second time about what has weight.
Exact Quadrature(const Record& record, const Output& output,
                 const std::vector<UncertainParameter>& priors, Vector lower, Vector upper) {
  constexpr int kPoints = 300;
  const auto n = static_cast<int>(priors.size());
  Exact exact;
  for (int pass = 0; pass < 2; ++pass) {
    const Vector step = (upper - lower) / kPoints;
    std::vector<Vector> points;
    std::vector<double> logs;
    for (int i = 0; i < kPoints; ++i) {
      for (int j = 0; j < (n == 1 ? 1 : kPoints); ++j) {
        Vector x = lower;
        x[0] += (i + 0.5) * step[0];
        if (n > 1) x[1] += (j + 0.5) * step[1];
        double log = 0;
        for (int p = 0; p < n; ++p) {
          const UncertainParameter& prior = priors[static_cast<size_t>(p)];
          const double z = (x[p] - prior.location) / prior.scale;
          if (prior.germ.family == GermFamily::kNormal) log -= 0.5 * z * z;
        }
        for (size_t k = 0; k < record.values.size(); ++k) {
          const double y = output(x[0], n > 1 ? x[1] : 0, static_cast<double>(k + 1));
          log -= RobustLoss(record.outliers, (record.values[k] - y) / record.noise);
        }
        points.push_back(x);
        logs.push_back(log);
      }
    }
    const double most = *std::ranges::max_element(logs);
    double sum = 0;
    Vector first = Vector::Zero(n), least = upper, largest = lower;
    for (size_t i = 0; i < points.size(); ++i) {
      const double weight = std::exp(logs[i] - most);
      sum += weight;
      first += weight * points[i];
      if (weight < 1e-7) continue;
      least = least.cwiseMin(points[i]);
      largest = largest.cwiseMax(points[i]);
    }
    exact.mean = first / sum;
    Vector second = Vector::Zero(n), fourth = Vector::Zero(n);
    for (size_t i = 0; i < points.size(); ++i) {
      const Vector square = (points[i] - exact.mean).cwiseAbs2();
      second += std::exp(logs[i] - most) / sum * square;
      fourth += std::exp(logs[i] - most) / sum * square.cwiseAbs2();
    }
    exact.std_dev = second.cwiseSqrt();
    exact.kurtosis = fourth.cwiseQuotient(second.cwiseAbs2());
    lower = lower.cwiseMax(least - 2 * step);
    upper = upper.cwiseMin(largest + 2 * step);
  }
  return exact;
}

Estimate EstimateOfRecord(const Record& record, const std::string& output,
                          const std::vector<UncertainParameter>& priors) {
  Problem problem = TextProblem(output, priors, record.noise);
  problem.measured[0].noise.outliers = record.outliers;
  return Processed(problem, record.values)->CurrentEstimate().value();
}

// The draws count as 1,000 independent ones at least, whose mean is known to 0.03 standard
// deviations, and whose standard deviation to √((κ − 1)/4000) of itself: 0.02 with the kurtosis
// κ = 3 of a normal density, more where tails are heavy. A misfit, which Huber's weights allow few
// gross errors for, widens what it contradicts.
void ExpectAgrees(const Estimate& estimate, const Exact& exact, double mean = 0.05,
                  double spread = 0.05) {
  const bool widened = Has(estimate, DiagnosticCode::kModelMisfit);
  for (size_t p = 0; p < estimate.parameters.size(); ++p) {
    const ParameterEstimate& parameter = estimate.parameters[p];
    const auto i = static_cast<Eigen::Index>(p);
    EXPECT_NEAR((parameter.mean - exact.mean[i]) / exact.std_dev[i], 0, mean) << parameter.name;
    const double ratio = parameter.posterior_std_dev / exact.std_dev[i];
    const double most = spread * std::sqrt(std::max(1.0, (exact.kurtosis[i] - 1) / 2));
    EXPECT_GT(ratio, 1 - most) << parameter.name;
    EXPECT_LT(ratio, widened ? kInfinity : 1 + most) << parameter.name;
  }
}

const Output kLine = [](double a, double b, double t) { return a + b * t; };

std::vector<UncertainParameter> PriorsOfLine() {
  return {*UncertainParameter::Normal("a", 0, 2), *UncertainParameter::Normal("b", 0, 1)};
}

void ExpectLineAgrees(const Record& record) {
  const Exact exact = Quadrature(record, kLine, PriorsOfLine(), Vector{{-10, -5}}, Vector{{10, 5}});
  ExpectAgrees(EstimateOfRecord(record, "a + b*t", PriorsOfLine()), exact);
}

class FewRobustSamples : public ::testing::TestWithParam<OutlierHandling> {};

// A gross error among four samples leaves a line through any three of them possible.
TEST_P(FewRobustSamples, OfALineWithAGrossErrorAgreeWithQuadrature) {
  ExpectLineAgrees({{2.61, 0.18, 1.07, 1.08}, 0.2, GetParam()});
  ExpectLineAgrees({{-0.42, 0.82, 1.21, 1.01, 0.80, 1.61}, 0.2, GetParam()});
}

// The errors are normal, and one sample in seven is grossly wrong.
TEST_P(FewRobustSamples, OfRandomLinesAgreeWithQuadrature) {
  for (const int count : {3, 5, 8, 12, 24}) {
    SCOPED_TRACE(count);
    std::mt19937_64 generator(static_cast<uint64_t>(count));
    std::normal_distribution<double> normal;
    Record record{{}, 0.2, GetParam()};
    for (int k = 1; k <= count; ++k) {
      const double gross = k % 7 == 2 ? 2 : 0;
      record.values.push_back(0.7 - 0.3 * k + gross + record.noise * normal(generator));
    }
    ExpectLineAgrees(record);
  }
}

// Two samples contradict two others, so that there are two modes that no sample lies between.
TEST_P(FewRobustSamples, InTwoClustersHaveTwoModes) {
  const std::vector<UncertainParameter> prior = {*UncertainParameter::Normal("a", 0, 0.3)};
  const Output constant = [](double a, double, double) { return a; };
  for (const double apart : {0.3, 0.8, 1.5}) {
    SCOPED_TRACE(apart);
    const Record record{{0, 0.05, apart, apart + 0.02}, 0.1, GetParam()};
    const Exact exact = Quadrature(record, constant, prior, Vector{{-2}}, Vector{{2}});
    ExpectAgrees(EstimateOfRecord(record, "a + 0*t", prior), exact);
  }
}

// In a damped vibration the frequency and the damping enter nonlinearly.
TEST_P(FewRobustSamples, OfADampedVibrationAgreeWithQuadrature) {
  const std::vector<UncertainParameter> priors = {*UncertainParameter::Uniform("a", 1, 2),
                                                  *UncertainParameter::Uniform("b", 0, 0.6)};
  const Output vibration = [](double a, double b, double t) {
    return std::exp(-b * t) * std::cos(a * t);
  };
  for (const int count : {6, 10}) {
    SCOPED_TRACE(count);
    std::mt19937_64 generator(3);
    std::normal_distribution<double> normal;
    Record record{{}, 0.1, GetParam()};
    for (int k = 1; k <= count; ++k) {
      const double gross = k == 3 ? 1.2 : 0;
      record.values.push_back(vibration(1.4, 0.15, k) + gross + record.noise * normal(generator));
    }
    const Exact exact = Quadrature(record, vibration, priors, Vector{{1, 0}}, Vector{{2, 0.6}});
    ExpectAgrees(EstimateOfRecord(record, "exp(-b*t)*cos(a*t)", priors), exact);
  }
}

// With more samples than are kept, weights stand for them. Their variances are those of M-estimates
// under normal noise, up to 1.14 times less than a t density leaves (VarianceFactor); and as the
// efficiency of an M-estimate of the scores is 0.93, its mean is √(1/0.93 − 1) = 0.27 standard
// deviations from that of the density at most.
TEST_P(FewRobustSamples, PassIntoManyThatAreWeighted) {
  for (const int count : {60, 64, 65, 90}) {
    SCOPED_TRACE(count);
    std::mt19937_64 generator(5);
    std::normal_distribution<double> normal;
    Record record{{}, 0.2, GetParam()};
    for (int k = 1; k <= count; ++k) {
      const double gross = k % 9 == 0 ? 3 : 0;
      record.values.push_back(0.5 - 0.02 * k + gross + record.noise * normal(generator));
    }
    const Exact exact =
        Quadrature(record, kLine, PriorsOfLine(), Vector{{-4, -0.5}}, Vector{{4, 0.5}});
    const bool kept = count <= 64;
    ExpectAgrees(EstimateOfRecord(record, "a + b*t", PriorsOfLine()), exact, kept ? 0.05 : 0.27,
                 kept ? 0.05 : 0.14);
  }
}

// The weights are renewed after every twentieth of the record, which here has a quarter of what is
// known: the information grows as t⁵. The minimum then moves by half a standard deviation, of which
// the weights of the old one, too steep by 7/5 (Σ w/Σ ρ″ of Student's t), withhold two sevenths.
// Two standard deviations of that are 0.28, which also covers how unevenly the samples are spread.
TEST_P(FewRobustSamples, KeepTheirWeightsUpToDate) {
  const std::vector<UncertainParameter> prior = {*UncertainParameter::Normal("a", 0, 1)};
  const Output growing = [](double a, double, double t) { return a * t * t / 10'000; };
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 generator(seed);
    std::student_t_distribution<double> heavy(4);
    Record record{{}, 0.2, GetParam()};
    for (int k = 1; k <= 290; ++k) {
      record.values.push_back(growing(0.5, 0, k) + record.noise * heavy(generator));
    }
    const Exact exact = Quadrature(record, growing, prior, Vector{{0.4}}, Vector{{0.6}});
    ExpectAgrees(EstimateOfRecord(record, "a*t^2/10000", prior), exact, 0.28, 0.14);
  }
}

// Weights that were taken while little was known would make a gross error a misfit.
TEST(FewSamplesOfStudentT, TakeAGrossErrorForNoMisfit) {
  for (const double gross : {3.0, 30.0, 300.0}) {
    const Record record{{0.9, 0.7, 0.45 + gross, 0.31, 0.12}};
    const Estimate estimate = EstimateOfRecord(record, "a + b*t", PriorsOfLine());
    EXPECT_FALSE(Has(estimate, DiagnosticCode::kModelMisfit)) << gross;
    EXPECT_EQ(estimate.channels[0].outliers, 1) << gross;
    ExpectLineAgrees(record);
  }
}

INSTANTIATE_TEST_SUITE_P(ByEveryMethod, FewRobustSamples,
                         ::testing::Values(OutlierHandling::kStudentT, OutlierHandling::kHuber));

}  // namespace
}  // namespace polyest::internal::few_robust_samples_test
