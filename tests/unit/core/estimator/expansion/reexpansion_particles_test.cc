#include "core/estimator/expansion/reexpansion_particles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>

#include "core/estimator/expansion/guarded_importance.h"
#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal {
namespace {

// Returns the design of the whole prior, with the box that is trusted.
ExpansionDesign DesignOf(const Prior& prior) {
  ExpansionDesign design;
  design.region = Region::WholePrior(prior.dimension());
  design.lower.resize(prior.dimension());
  design.upper.resize(prior.dimension());
  for (int i = 0; i < prior.dimension(); ++i) {
    const auto [lower, upper] = TrustedRange(prior.germs()[static_cast<size_t>(i)]);
    design.lower[i] = lower;
    design.upper[i] = upper;
  }
  return design;
}

Particles Sample(const Cost& cost, const ExpansionDesign& design, uint64_t seed) {
  return SampleForReexpansion(cost, design, Matrix(0, cost.dimension()), seed, Stop()).value();
}

// The data z_i of noise σ leave N(z_i, σ²) of uniform priors that are far wider. Four standard
// errors of as many random draws as half the particles are allowed.
TEST(ReexpansionParticles, HaveTheMomentsOfManyParameters) {
  const int n = 40;
  const double noise = 5e-4;
  const Vector z = Vector::LinSpaced(n, -0.9, 0.8);
  const Prior prior = ManyUniforms(n);
  const Particles particles = Sample(CostOfEach(prior, z, noise), DesignOf(prior), 1);
  ASSERT_EQ(particles.etas.rows(), 1000);
  for (int i = 0; i < n; ++i) {
    const Vector column = particles.etas.col(i).array() - z[i];
    EXPECT_NEAR(column.mean(), 0, 4 * noise / std::sqrt(500.0)) << i;
    EXPECT_NEAR(column.norm() / std::sqrt(1000.0) / noise, 1, 4 / std::sqrt(1000.0)) << i;
  }
}

// Importance sampling evaluates the cost at far fewer points than tempering would.
TEST(ReexpansionParticles, AreDrawnByImportanceSamplingFromAGaussian) {
  const Prior prior = ManyNormals(3);
  const ExpansionDesign design = DesignOf(prior);
  const Cost cost = CostOfEach(prior, Vector::Ones(3), 0.5);
  const GuardedDraws drawn = DrawIfNearlyGaussian(cost, design, Matrix(0, 3), 4096, Stop());
  ASSERT_TRUE(drawn.draws.has_value());
  EXPECT_EQ(drawn.minima.size(), 1U);
  // The particles are among the draws, with the costs that belong to them.
  const Particles particles = Sample(cost, design, 1);
  for (Eigen::Index i = 0; i < particles.etas.rows(); i += 100) {
    const auto distance = (drawn.draws->etas.rowwise() - particles.etas.row(i)).rowwise().norm();
    Eigen::Index nearest;
    EXPECT_EQ(distance.minCoeff(&nearest), 0);
    EXPECT_EQ(drawn.draws->costs[nearest], particles.costs[i]);
  }
}

// The first particles become check points, so they must be draws like any others. The first points
// of a Halton sequence are not: each coordinate ascends.
TEST(ReexpansionParticles, AreInRandomOrder) {
  const Prior prior = ManyNormals(2);
  const ExpansionDesign design = DesignOf(prior);
  const Cost cost = CostOfEach(prior, Vector::Zero(2), 1);
  const Particles one = Sample(cost, design, 1), other = Sample(cost, design, 2);
  EXPECT_EQ(one.etas, Sample(cost, design, 1).etas);
  EXPECT_NE(one.etas, other.etas);
  double sum = 0;  // of the products of neighbours, whose standard error is σ²/√999, σ² = ½
  for (Eigen::Index i = 1; i < 1000; ++i) sum += one.etas(i, 1) * one.etas(i - 1, 1);
  EXPECT_NEAR(sum / 999, 0, 4 * 0.5 / std::sqrt(999.0));
}

// a² = 1 leaves a = ±1, which no single Gaussian approximates.
TEST(ReexpansionParticles, AreDrawnByTemperingFromTwoPieces) {
  const Prior prior = ManyNormals(2);
  const ExpansionDesign design = DesignOf(prior);
  const Cost cost = CostOf(prior, {{[](const Vector& xi) { return xi[0] * xi[0]; }, 1, 0.1}});
  EXPECT_FALSE(DrawIfNearlyGaussian(cost, design, Matrix(0, 2), 4096, Stop()).draws.has_value());
  const Particles particles = Sample(cost, design, 1);
  const auto above = (particles.etas.col(0).array() > 0).count();
  EXPECT_NEAR(static_cast<double>(above), 500, 4 * std::sqrt(500.0));
}

TEST(ReexpansionParticles, AreCancelledByAStopRequest) {
  std::stop_source source;
  source.request_stop();
  const Prior prior = ManyNormals(2);
  const auto particles =
      SampleForReexpansion(CostOfEach(prior, Vector::Zero(2), 1), DesignOf(prior), Matrix(0, 2), 1,
                           Stop(source.get_token()));
  EXPECT_EQ(particles.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace polyest::internal
