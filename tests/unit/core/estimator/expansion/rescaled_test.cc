// Expansions that go on with another scale of the noise or another tolerance. The oracle is the
// record propagated again with it.

#include "core/estimator/expansion/rescaled.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/estimator/expansion/carry_over.h"
#include "core/estimator/expansion/replay.h"
#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/record/memory_store.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::rescaled_test {
namespace {

constexpr int64_t kCheckpoint = 100, kRows = 650;
constexpr double kNoise = 0.02;

// x and y are polynomials of a and b, so that the expansion has no error of its own.
Problem TwoChannels() {
  EquationSpecification equations;
  equations.states = {{"x", "a * cos(3 * t)"}, {"y", "b * a * sin(t)"}};
  equations.outputs = {{"x", "x"}, {"y", "y"}};
  Problem problem;
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = {UncertainParameter::Normal("a", 1, 0.3).value(),
                       UncertainParameter::Uniform("b", 0, 2).value()};
  problem.measured = {{"x", {.absolute = kNoise, .unknown = true}}, {"y", {.absolute = kNoise}}};
  problem.expansion.order = 3;
  problem.integration.relative_tolerance = 1e-12;
  problem.integration.samples_between_checkpoints = kCheckpoint;
  return problem;
}

RowBlock Rows() {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal(0, kNoise);
  RowBlock block;
  for (int64_t k = 1; k <= kRows; ++k) {
    const double t = 0.05 * static_cast<double>(k);
    block.rows.push_back({0, t});
    const double x = std::sin(3 * t) / 3 + 2 * normal(generator), y = 1.2 * (1 - std::cos(t));
    block.values.insert(block.values.end(), {x, y + normal(generator)});
    block.noise.insert(block.noise.end(), {kNoise, kNoise});
  }
  return block;
}

class RescaledExpansion : public ::testing::Test {
 protected:
  void SetUp() override {
    problem_ = std::make_unique<ResolvedProblem>(ResolvedProblem::Make(TwoChannels()).value());
    ASSERT_TRUE(store_.Append(Rows()).ok());
    noise_ = NoiseToBeginWith(problem_->problem());
    noise_.channels[0].learned = true;
    present_ = Replayed(noise_);
  }

  std::unique_ptr<RegionalExpansion> Replayed(const LearnedNoise& noise) const {
    return Replay(*problem_, DesignForPrior(*problem_).value(), noise, store_, kRows, 1, Stop())
        .value();
  }
  auto WithNoise(const LearnedNoise& noise) const {
    return Rescaled(*problem_, *present_, noise, store_, kRows, 1, Stop());
  }

  std::unique_ptr<ResolvedProblem> problem_;
  MemoryStore store_;
  LearnedNoise noise_;
  std::unique_ptr<RegionalExpansion> present_;
};

void ExpectSameCosts(const RegionalExpansion& a, const RegionalExpansion& b, double tolerance) {
  const Cost cost_a = a.MakeCost(1), cost_b = b.MakeCost(1);
  for (const double x : {-1.0, 0.0, 1.0}) {
    for (const double y : {-0.5, 0.5}) {
      const double expected = cost_b.Evaluate(Vector{{x, y}}).total;
      EXPECT_NEAR(cost_a.Evaluate(Vector{{x, y}}).total, expected, tolerance * expected);
    }
  }
}

TEST_F(RescaledExpansion, IsThatOfAReplayWithTheOtherScale) {
  noise_.channels[0].scale = 1.9;
  const auto rescaled = WithNoise(noise_);
  ASSERT_TRUE(rescaled.ok()) << rescaled.status();
  const auto replayed = Replayed(noise_);
  EXPECT_EQ((*rescaled)->propagated_rows() * 13, replayed->propagated_rows());  // 50 of 650 rows
  ExpectSameCosts(**rescaled, *replayed, 1e-9);
  EXPECT_LT(((*rescaled)->absorbed().PointChiSquared() - replayed->absorbed().PointChiSquared())
                .cwiseAbs()
                .maxCoeff(),
            1e-9 * replayed->absorbed().PointChiSquared().maxCoeff());
  EXPECT_NEAR((*rescaled)->absorbed().LogNormalization(false),
              replayed->absorbed().LogNormalization(false), 1e-9);
  const int last = replayed->windows().count() - 2;
  const auto a = (*rescaled)->windows().TotalsAt(last, (*rescaled)->sums());
  const auto b = replayed->windows().TotalsAt(last, replayed->sums());
  ASSERT_EQ(a.size(), b.size());
  for (size_t group = 0; group < a.size(); ++group) {
    EXPECT_LT((a[group].g - b[group].g).cwiseAbs().maxCoeff(),
              1e-9 * b[group].g.cwiseAbs().maxCoeff());
  }
}

TEST_F(RescaledExpansion, KeepsItsSumsWithAnotherTolerance) {
  problem_->set_relative_tolerance(5e-13);
  const auto going_on = WithNoise(noise_);
  ASSERT_TRUE(going_on.ok()) << going_on.status();
  ExpectSameCosts(**going_on, *present_, 1e-9);
}

TEST_F(RescaledExpansion, IsRefusedWhereMoreThanScalesDiffers) {
  LearnedNoise correlated = noise_;
  correlated.channels[0].time_constant_s = 0.1;
  EXPECT_TRUE(absl::IsFailedPrecondition(WithNoise(correlated).status()));
  LearnedNoise forgotten = noise_;
  forgotten.channels[0].learned = false;
  EXPECT_TRUE(absl::IsFailedPrecondition(WithNoise(forgotten).status()));
}

}  // namespace
}  // namespace polyest::internal::rescaled_test
