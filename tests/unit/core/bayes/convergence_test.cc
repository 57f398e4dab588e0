#include "core/bayes/convergence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace polyest::internal {
namespace {

// Makes chains of x_t = ρ x_{t−1} + √(1 − ρ²) ε, started from the stationary N(0, 1).
Matrix Autoregressive(int times, int chains, double correlation) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  Matrix draws(times, chains);
  for (int s = 0; s < chains; ++s) {
    draws(0, s) = normal(generator);
    for (int t = 1; t < times; ++t) {
      draws(t, s) = correlation * draws(t - 1, s) +
                    std::sqrt(1 - correlation * correlation) * normal(generator);
    }
  }
  return draws;
}

TEST(RankNormalized, GivesNormalScoresWhateverTheQuantity) {
  Matrix draws(2, 2);
  draws << 3, -1, 700, 2;
  const Matrix scores = RankNormalized(draws);
  // The largest draw has the score Φ⁻¹((4 − 3/8)/(4 + 1/4)); the smallest mirrors it.
  EXPECT_NEAR(scores(1, 0), 1.0491313979639714, 1e-12);
  EXPECT_NEAR(scores(0, 1), -scores(1, 0), 1e-12);
  EXPECT_EQ(scores, RankNormalized(draws.array().exp().matrix().cwiseMin(1e300)));
}

TEST(RankNormalized, LetsEqualDrawsShareTheirRanks) {
  Matrix draws(1, 4);
  draws << 5, 1, 5, 9;
  const Matrix scores = RankNormalized(draws);
  EXPECT_EQ(scores(0, 0), scores(0, 2));
  EXPECT_NEAR(scores(0, 0), 0, 1e-12);  // the middle of four ranks
}

// The variance of the means of 8 sequences of N white draws is W/N. R̂² − 1 is therefore about 1/N
// times the variation of a χ² of 7 degrees over 7: below 4.4 with probability 1 − 10⁻⁴.
TEST(SplitRHat, IsOneForChainsThatAgree) {
  const Matrix draws = Autoregressive(50, 40, 0);
  const double count = 25 * 10;
  EXPECT_LT(SplitRHat(RankNormalized(draws), 4), std::sqrt(1 + 4.4 / count));
}

TEST(SplitRHat, SeesAGroupThatDiffersFromTheOthers) {
  Matrix draws = Autoregressive(50, 40, 0);
  draws.leftCols(10).array() += 1;
  EXPECT_GT(SplitRHat(RankNormalized(draws), 4), 1.05);
}

TEST(SplitRHat, SeesADriftThatAllGroupsShare) {
  Matrix draws = Autoregressive(50, 40, 0);
  draws.bottomRows(25).array() += 1;
  EXPECT_GT(SplitRHat(RankNormalized(draws), 4), 1.05);
}

TEST(SplitRHat, IsOneForDrawsThatDoNotVary) {
  EXPECT_EQ(SplitRHat(RankNormalized(Matrix::Ones(10, 8)), 4), 1);
}

// The oracle is τ = (1 + ρ)/(1 − ρ) of an autoregressive chain. An estimate from N draws that sums
// M lags has the relative variance 2 (2M + 1)/N (A. Sokal, Monte Carlo Methods in Statistical
// Mechanics, 1996). Its root is 8 % for the last chain, with some 60 lags; the bound is three of
// these.
TEST(EffectiveSize, IsThatOfAnAutoregressiveProcess) {
  for (const double correlation : {0.0, 0.5, 0.9}) {
    const Matrix draws = Autoregressive(400, 100, correlation);
    const double expected = 40'000 * (1 - correlation) / (1 + correlation);
    EXPECT_NEAR(EffectiveSize(RankNormalized(draws)) / expected, 1, 0.24) << correlation;
  }
}

// Chains that never move are worth one draw each, or two as far as T times can tell.
TEST(EffectiveSize, OfChainsThatDoNotMoveIsTheirNumber) {
  const Matrix start = Autoregressive(1, 500, 0);
  const double effective = EffectiveSize(RankNormalized(start.replicate(40, 1)));
  EXPECT_LT(effective, 2 * 500);
  EXPECT_GT(effective, 250);
}

}  // namespace
}  // namespace polyest::internal
