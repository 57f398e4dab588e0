// Tests what re-expansions keep, by itself and by what an estimator no longer does again.

#include "core/estimator/expansion/reexpansion_memory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>

#include "core/estimator/expansion/reexpansion_particles.h"
#include "core/estimator/record/memory_store.h"
#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

constexpr double kAccepted = 0.05;
constexpr int64_t kRows = 100;

ExpansionDesign StandardDesign() {
  ExpansionDesign design;
  design.region = Region::WholePrior(1);
  const auto [lower, upper] = TrustedRange(ManyNormals(1).germs().front());
  design.lower = Vector::Constant(1, lower);
  design.upper = Vector::Constant(1, upper);
  return design;
}

// Returns the cost of the datum z of noise 1; with the prior N(0, 1) it leaves N(z/2, 1/2).
Cost CostOfDatum(const Prior& prior, double z) {
  return CostOfEach(prior, Vector::Constant(1, z), 1);
}

// The posterior N(0, 1/2) moves by d = 0.05 to N(0.05, 1/2): by 0.07 standard deviations. The
// weights have the effective size exp(−d²/s²) = 0.995 of the number. The mean of 1000 draws moves
// by d with the standard error d √(2/1000) of a covariance; resampling adds less than 6 s/1000.
TEST(ReexpansionMemory, ReweighsParticlesOfAPosteriorThatHardlyMoved) {
  const Prior prior = ManyNormals(1);
  const ExpansionDesign design = StandardDesign();
  const Particles drawn =
      SampleForReexpansion(CostOfDatum(prior, 0), design, Matrix(0, 1), 1, Stop()).value();
  const Matrix particles = design.region.ManyToGerm(drawn.etas);
  const Matrix now = Reweighted(particles, drawn.costs, CostOfDatum(prior, 0.1), design);
  ASSERT_EQ(now.rows(), particles.rows());
  EXPECT_NEAR(now.mean() - particles.mean(), 0.05, 4 * 0.05 * std::sqrt(2e-3) + 0.006);
}

// By 0.7 standard deviations: the effective size is exp(−1/2) = 0.61 of the number.
TEST(ReexpansionMemory, NeedsNewParticlesOfAPosteriorThatMoved) {
  const Prior prior = ManyNormals(1);
  const ExpansionDesign design = StandardDesign();
  const Particles drawn =
      SampleForReexpansion(CostOfDatum(prior, 0), design, Matrix(0, 1), 1, Stop()).value();
  EXPECT_EQ(Reweighted(drawn.etas, drawn.costs, CostOfDatum(prior, 1), design).rows(), 0);
  EXPECT_EQ(Reweighted(drawn.etas, Vector(), CostOfDatum(prior, 0), design).rows(), 0);
}

Region Box(double x, double half_width) {
  return Region(Vector::Unit(2, 0) * x, Matrix::Identity(2, 2) * half_width);
}

LearnedNoise NoiseOfScale(double scale) {
  LearnedNoise noise;
  noise.channels.resize(1);
  noise.channels[0].scale = scale;
  return noise;
}

bool IsInVain(const Region& region, int64_t rows, double scale) {
  const OrderInVain tried = TriedInVain(5, 4 * kAccepted, Box(0, 1), kRows, NoiseOfScale(1));
  return IsRaisingInVain(tried, kAccepted, region, rows, NoiseOfScale(scale));
}

TEST(ReexpansionMemory, KnowsAnOrderInVainOverTheSameAndALargerRegion) {
  EXPECT_TRUE(IsInVain(Box(0, 1), kRows, 1));
  EXPECT_TRUE(IsInVain(Box(0, 2), kRows, 1));
  EXPECT_FALSE(IsInVain(Box(0, 0.5), kRows, 1));
  EXPECT_FALSE(IsInVain(Box(1, 1), kRows, 1));
  EXPECT_FALSE(IsRaisingInVain(OrderInVain(), kAccepted, Box(0, 1), kRows, NoiseOfScale(1)));
}

TEST(ReexpansionMemory, ForgetsAnOrderInVainWhenTheRecordDoublesOrTheNoiseGrows) {
  EXPECT_TRUE(IsInVain(Box(0, 1), 2 * kRows - 1, 1));
  EXPECT_FALSE(IsInVain(Box(0, 1), 2 * kRows, 1));
  // An error of four times what is accepted is as large as that when the noise is twice as large.
  EXPECT_TRUE(IsInVain(Box(0, 1), kRows, 1.99));
  EXPECT_FALSE(IsInVain(Box(0, 1), kRows, 2.01));
}

// Counts the rows that are read from it.
class CountingStore final : public SampleStore {
 public:
  int64_t rows() const override { return samples_.rows(); }
  absl::Status Append(const RowBlock& block) override { return samples_.Append(block); }
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override {
    rows_read_ += count;
    return samples_.Read(first, count, block);
  }
  int64_t rows_read() const { return rows_read_; }

 private:
  MemoryStore samples_;
  mutable int64_t rows_read_ = 0;
};

// The output has thirteen periods over the prior, which no order follows, and the data allow values
// in all of them. There are too many dimensions to bisect elements.
Problem HopelessProblem() {
  std::vector<UncertainParameter> parameters;
  for (const char* name : {"a", "b", "c", "d", "e"}) {
    parameters.push_back(UncertainParameter::Uniform(name, -1, 1).value());
  }
  return TextProblem("sin(40*a) + 0*(b + c + d + e)", parameters, 0.2);
}

struct HopelessRun {
  int64_t rows_read = 0;
  Estimate estimate;
};

HopelessRun RunHopelessly(int rows) {
  auto store = std::make_shared<CountingStore>();
  EstimatorOptions options;
  options.store = store;
  const auto estimator = MakeEstimator(HopelessProblem(), options);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int k = 1; k <= rows; ++k) {
    samples.time_s.push_back(k);
    samples.columns[0].value.push_back(0.5 + 0.05 * std::sin(k));
  }
  EXPECT_TRUE(estimator->Append(samples).ok());
  EXPECT_TRUE(estimator->Process().ok());
  return {store->rows_read(), estimator->CurrentEstimate().value()};
}

// Two orders can be afforded, and each replays the record. They are tried when the first sample is
// too coarse, at a row r ≥ 1, and then no more than once while the record doubles: at most over
// 2 (r + 2 r + … + N) < 4 N rows. As many are read again where the present block of rows is
// propagated anew after an attempt, and each row once at least.
TEST(ReexpansionMemory, HigherOrdersAreTriedInVainOnceWhileTheRecordDoubles) {
  constexpr int kHopelessRows = 60;
  const HopelessRun run = RunHopelessly(kHopelessRows);
  EXPECT_TRUE(Has(run.estimate, DiagnosticCode::kExpansionInaccurate));
  EXPECT_LT(run.rows_read, (4 + 1 + 1) * kHopelessRows);
}

// The trajectories of the estimate are all that were run: of the orders 5 and 7 with 252 and 792
// terms, two points a term, at least over the first of two rows.
TEST(ReexpansionMemory, TrajectoriesOfOrdersTriedInVainCount) {
  EXPECT_GE(RunHopelessly(2).estimate.expansion.trajectories, (2 * 252 + 2 * 792) / 2);
}

}  // namespace
}  // namespace polyest::internal
