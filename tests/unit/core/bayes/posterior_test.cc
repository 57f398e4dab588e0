#include "core/bayes/posterior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <stop_token>

#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal::posterior_test {
namespace {

Prior OneUniform() { return Prior({UncertainParameter::Uniform("a", -1, 1).value()}); }
Prior OneNormal() { return Prior({UncertainParameter::Normal("a", 0, 1).value()}); }

Vector Filled(int size, double value) { return Vector::Constant(size, value); }

Particles Sample(const Cost& cost, double half_width, const SamplerOptions& options,
                 const Matrix& guesses) {
  const int n = cost.dimension();
  return SamplePosterior(cost, Filled(n, -half_width), Filled(n, half_width), guesses, options, {})
      .value();
}

Particles Sample(const Cost& cost, double half_width, const SamplerOptions& options = {}) {
  return Sample(cost, half_width, options, Matrix(0, cost.dimension()));
}

// The bounds are four standard errors. Tempering never lets the effective size fall below half, and
// moves only renew the copies that resampling made, so that the particles are worth at least half
// their number of independent draws. A mean then has the standard error s/√(N/2). A standard
// deviation (of a density whose tails are no longer than a Gaussian's) has s/√N, and a probability
// p has √(p (1 − p)/(N/2)).
double MeanError(double std_dev, Eigen::Index particles) {
  return 4 * std_dev / std::sqrt(0.5 * static_cast<double>(particles));
}
double StdDevError(double std_dev, Eigen::Index particles) {
  return 4 * std_dev / std::sqrt(static_cast<double>(particles));
}

struct Moments {
  double mean = 0;
  double std_dev = 0;
};

Moments MomentsOf(const Vector& samples) {
  const double mean = samples.mean();
  return {mean, std::sqrt((samples.array() - mean).square().mean())};
}

// Computes the moments of the density e^{−J} on [−bound, bound] by the midpoint rule.
Moments MomentsByQuadrature(const std::function<double(double)>& cost, double bound) {
  constexpr int kCells = 200'000;
  double weight = 0, first = 0, second = 0;
  for (int i = 0; i < kCells; ++i) {
    const double xi = bound * (2 * (i + 0.5) / kCells - 1);
    const double density = std::exp(-cost(xi));
    weight += density;
    first += density * xi;
    second += density * xi * xi;
  }
  return {first / weight, std::sqrt(second / weight - first * first / (weight * weight))};
}

void ExpectMoments(const Vector& samples, const Moments& expected) {
  const Moments moments = MomentsOf(samples);
  EXPECT_NEAR(moments.mean, expected.mean, MeanError(expected.std_dev, samples.size()));
  EXPECT_NEAR(moments.std_dev, expected.std_dev, StdDevError(expected.std_dev, samples.size()));
}

// The prior is normal and the outputs are linear in ξ, so that the posterior is the Gaussian of
// precision I + aaᵀ/σ².
TEST(SamplePosterior, HasTheMomentsOfAGaussian) {
  const Prior prior({UncertainParameter::Normal("a", 0, 1).value(),
                     UncertainParameter::Normal("b", 0, 1).value()});
  const Eigen::Vector2d a(1, 2);
  const double z = 1.5, noise = 0.3;
  const Cost cost = CostOf(prior, {{[&](const Vector& xi) { return a.dot(xi); }, z, noise}});
  const Eigen::Matrix2d covariance =
      (Eigen::Matrix2d::Identity() + a * a.transpose() / (noise * noise)).inverse();
  const Eigen::Vector2d mean = covariance * a * z / (noise * noise);
  const Particles particles = Sample(cost, 6);
  const auto count = static_cast<double>(particles.etas.rows());
  EXPECT_EQ(particles.etas.rows(), SamplerOptions().particles);
  for (int i = 0; i < 2; ++i) {
    ExpectMoments(particles.etas.col(i), {mean[i], std::sqrt(covariance(i, i))});
  }
  // The checks below cover the direction that is six times narrower than either parameter alone,
  // and the correlation.
  const Vector along = particles.etas * (a / a.norm());
  ExpectMoments(along, {a.dot(mean) / a.norm(), 1 / std::sqrt(1 + 5 / (noise * noise))});
  const double product =
      ((particles.etas.col(0).array() - mean[0]) * (particles.etas.col(1).array() - mean[1]))
          .mean();
  const double spread =
      std::sqrt(covariance(0, 0) * covariance(1, 1) + covariance(0, 1) * covariance(0, 1));
  EXPECT_NEAR(product, covariance(0, 1), 4 * spread / std::sqrt(0.5 * count));
}

TEST(SamplePosterior, ReportsTheCostOfEachParticle) {
  const Cost cost = CostOf(OneNormal(), {{[](const Vector& xi) { return xi[0]; }, 0.4, 0.2}});
  const Particles particles = Sample(cost, 5);
  for (Eigen::Index i = 0; i < particles.etas.rows(); ++i) {
    const double expected = cost.Evaluate(particles.etas.row(i).transpose()).total;
    EXPECT_NEAR(particles.costs[i], expected, 1e-12 * (1 + expected));
  }
}

// The peak is 10⁻⁴ as wide as the box.
TEST(SamplePosterior, FindsANarrowPeak) {
  const double noise = 1e-4;
  const Cost cost = CostOf(OneUniform(), {{[](const Vector& xi) { return xi[0]; }, 0.3, noise}});
  ExpectMoments(Sample(cost, 1.15).etas.col(0), {0.3, noise});
}

TEST(SamplePosterior, ReturnsThePriorWhereTheDataSayNothing) {
  ExpectMoments(Sample(CostOf(OneUniform(), {}), 1.15).etas.col(0), {0, 1 / std::sqrt(3)});
  ExpectMoments(Sample(CostOf(OneNormal(), {}), 7).etas.col(0), {0, 1});
}

TEST(SamplePosterior, StopsAtABoundOfThePrior) {
  const double z = 1.2, noise = 0.3;  // The most likely value lies beyond the bound.
  const Cost cost = CostOf(OneUniform(), {{[](const Vector& xi) { return xi[0]; }, z, noise}});
  const Particles particles = Sample(cost, 1.15);
  EXPECT_LE(particles.etas.maxCoeff(), 1);
  ExpectMoments(particles.etas.col(0), MomentsByQuadrature(
                                           [&](double xi) {
                                             const double error = (xi - z) / noise;
                                             return 0.5 * error * error;
                                           },
                                           1));
}

TEST(SamplePosterior, StaysInTheBox) {
  const Particles particles = Sample(CostOf(OneNormal(), {}), 0.5);
  EXPECT_LE(particles.etas.cwiseAbs().maxCoeff(), 0.5);
  ExpectMoments(particles.etas.col(0),
                MomentsByQuadrature([](double xi) { return 0.5 * xi * xi; }, 0.5));
}

double ShareAboveZero(const Particles& particles) {
  return (particles.etas.col(0).array() > 0).cast<double>().mean();
}

// The data measure ξ²: the posterior has two pieces of equal weight, which no move of the size of
// one piece connects.
TEST(SamplePosterior, KeepsBothPiecesOfASymmetricPosterior) {
  const double z = 0.36, noise = 0.05;
  for (const Prior& prior : {OneUniform(), OneNormal()}) {
    const Cost cost = CostOf(prior, {{[](const Vector& xi) { return xi[0] * xi[0]; }, z, noise}});
    const double bound = std::isfinite(prior.upper()[0]) ? 1 : 4;
    const Particles particles = Sample(cost, bound);
    const auto count = static_cast<double>(particles.etas.rows());
    EXPECT_NEAR(ShareAboveZero(particles), 0.5, 4 * 0.5 / std::sqrt(0.5 * count));
    // The modulus |ξ| has the moments of either piece.
    const double weight = std::isfinite(prior.upper()[0]) ? 0 : 1;
    const auto density = [&](double xi) {
      const double error = (xi * xi - z) / noise;
      return 0.5 * error * error + 0.5 * weight * xi * xi;
    };
    const Moments expected =
        MomentsByQuadrature([&](double xi) { return xi < 0 ? INFINITY : density(xi); }, bound);
    const Moments moments = MomentsOf(particles.etas.col(0).cwiseAbs());
    EXPECT_NEAR(moments.mean, expected.mean, MeanError(expected.std_dev, particles.etas.rows()));
  }
}

// The guesses say where to look and must not decide what is found.
TEST(SamplePosterior, FindsThePieceThatTheGuessesMiss) {
  const Cost cost =
      CostOf(OneUniform(), {{[](const Vector& xi) { return xi[0] * xi[0]; }, 0.36, 0.05}});
  const Matrix guesses = Matrix::Constant(1000, 1, 0.6) + 0.04 * Matrix::Random(1000, 1);
  const Particles particles = Sample(cost, 1, {}, guesses);
  EXPECT_GT(ShareAboveZero(particles), 0.25);
  EXPECT_LT(ShareAboveZero(particles), 0.75);
}

TEST(SamplePosterior, IsAFunctionOfItsArgumentsAlone) {
  const Cost cost = CostOf(OneNormal(), {{[](const Vector& xi) { return xi[0]; }, 0.4, 0.2}});
  SamplerOptions options;
  options.particles = 100;
  const Particles first = Sample(cost, 5, options);
  const Particles again = Sample(cost, 5, options);
  EXPECT_EQ(first.etas, again.etas);
  EXPECT_EQ(first.costs, again.costs);
  options.seed = 2;
  EXPECT_NE(first.etas, Sample(cost, 5, options).etas);
}

TEST(SamplePosterior, IsCancelledByAStopRequest) {
  const Cost cost = CostOf(OneNormal(), {});
  std::stop_source source;
  source.request_stop();
  const auto particles = SamplePosterior(cost, Filled(1, -5), Filled(1, 5), Matrix(0, 1), {},
                                         Stop(source.get_token()));
  EXPECT_EQ(particles.status().code(), absl::StatusCode::kCancelled);
}

// The box reaches beyond Ω as an expansion's does. Of 4,000 points of it not one would lie in Ω:
// the fraction is 1.15⁻⁶⁴ ≈ 10⁻⁴. The posterior is the prior, of standard deviation 1/√3.
TEST(SamplePosterior, StartsInManyDimensions) {
  const int n = 64;
  const Particles particles = Sample(CostOfEach(ManyUniforms(n), Vector(0), 1), 1.15);
  ASSERT_EQ(particles.etas.rows(), 1000);
  for (int j = 0; j < n; ++j) {
    EXPECT_NEAR(particles.etas.col(j).mean(), 0, MeanError(1 / std::sqrt(3.0), 1000));
    EXPECT_LE(particles.etas.col(j).cwiseAbs().maxCoeff(), 1);
  }
}

TEST(SamplePosterior, NeedsSomewhereToStart) {
  const auto particles =
      SamplePosterior(CostOf(OneUniform(), {}), Filled(1, 2), Filled(1, 3), Matrix(0, 1), {}, {});
  EXPECT_EQ(particles.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(particles.status().message(),
            "only 0 of 4000 starting points of the sampler have a finite cost");
}

}  // namespace
}  // namespace polyest::internal::posterior_test
