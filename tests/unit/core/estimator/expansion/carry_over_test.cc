// Sums carried over to another region. The oracle is the record propagated again from its
// beginning: for outputs that are polynomials of the unknowns the costs are the same up to the
// error of integration, and otherwise the posterior up to kMaxCarriedShift.

#include "core/estimator/expansion/carry_over.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/estimator/expansion/expansion_state.h"
#include "core/estimator/expansion/replay.h"
#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/record/memory_store.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/snapshot_session.h"
#include "tests/unit/core/estimator/stopping_store.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::carry_over_test {
namespace {

constexpr double kNoise = 0.01;
constexpr int64_t kKept = 400, kRows = 650;  // of the record, and where its state is kept

// x' = a cos 3t, so that z = x² + a b cos 2t is a polynomial of a and b of degree 2.
Problem PolynomialProblem() {
  EquationSpecification equations;
  equations.states = {{"x", "a * cos(3 * t)"}};
  equations.outputs = {{"z", "x^2 + a * b * cos(2 * t)"}, {"x", "x"}};
  Problem problem;
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = {UncertainParameter::Normal("a", 1, 0.3).value(),
                       UncertainParameter::Uniform("b", 0, 2).value()};
  problem.measured = {{"z", {.absolute = kNoise}}, {"x", {.absolute = 3 * kNoise}}};
  problem.expansion.order = 3;
  problem.integration.relative_tolerance = 1e-12;
  problem.integration.samples_between_checkpoints = kKept;
  return problem;
}

RowBlock PolynomialRows() {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal(0, kNoise);
  RowBlock block;
  for (int64_t k = 1; k <= kRows; ++k) {
    const double t = kStep * static_cast<double>(k), x = std::sin(3 * t) / 3;
    block.rows.push_back({0, t});
    const double z = x * x + 1.2 * std::cos(2 * t) + normal(generator);
    block.values.insert(block.values.end(), {z, x + 3 * normal(generator)});
    block.noise.insert(block.noise.end(), {kNoise, 3 * kNoise});
  }
  return block;
}

class CarriedSums : public ::testing::Test {
 protected:
  void Begin(const Problem& problem, const RowBlock& rows) {
    problem_ = std::make_unique<ResolvedProblem>(ResolvedProblem::Make(problem).value());
    ASSERT_TRUE(store_.Append(rows).ok());
    present_ = Replayed(DesignForPrior(*problem_).value());
  }

  std::unique_ptr<RegionalExpansion> Replayed(ExpansionDesign design, int64_t rows = kRows) const {
    return Replay(*problem_, std::move(design), NoiseToBeginWith(problem_->problem()), store_, rows,
                  1, Stop())
        .value();
  }
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> Carried(const ExpansionDesign& design) const {
    return CarryOver(*problem_, *present_, design, store_, kRows, 1, Stop());
  }
  // A turned box inside the prior, in germ coordinates.
  ExpansionDesign DesignInside(double size = 0.5) const {
    const Vector centre = Vector::Constant(2, 0.1);
    Matrix axes(2, 2);
    axes << size, 0.2 * size, -0.3 * size, size;
    ExpansionDesign design = DesignForRegion(*problem_, present_->design().basis->truncation(),
                                             Region(centre, axes), centre);
    SpreadCheckPoints(*problem_, centre, design);
    return design;
  }

  std::unique_ptr<ResolvedProblem> problem_;
  MemoryStore store_;
  std::unique_ptr<RegionalExpansion> present_;
};

// Returns J over the box less J at its centre.
Vector CostsOver(const RegionalExpansion& expansion) {
  const Cost cost = expansion.MakeCost(1);
  Vector costs(9);
  for (int i = 0; i < 9; ++i) {
    costs[i] = cost.Evaluate(Vector{{i / 3 - 1.0, i % 3 - 1.0}}).total;
  }
  return costs.array() - costs[4];
}

TEST_F(CarriedSums, AreThoseOfAReplayForPolynomialsOfTheUnknowns) {
  Begin(PolynomialProblem(), PolynomialRows());
  const auto carried = Carried(DesignInside());
  ASSERT_TRUE(carried.ok()) << carried.status();
  const auto replayed = Replayed(DesignInside());
  // 250 of 650 rows: by 30 trajectories, as in the replay, and by five pairs to judge the states.
  EXPECT_EQ((*carried)->propagated_rows(), 250 * (30 + 10));
  EXPECT_EQ(replayed->propagated_rows(), 650 * 30);
  EXPECT_EQ((*carried)->absorbed_rows(), kRows);
  const Vector expected = CostsOver(*replayed);
  ASSERT_GT(expected.maxCoeff(), 100);
  // An error of 1e-12 of each output, with 650 samples of a signal of 100 standard deviations,
  // changes χ² by less than 650 · 100² · 1e-12.
  EXPECT_LT((CostsOver(**carried) - expected).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT(((*carried)->absorbed().PointChiSquared() - replayed->absorbed().PointChiSquared())
                .cwiseAbs()
                .maxCoeff(),
            1e-4);
  for (int c = 0; c < 2; ++c) {
    const ChannelSums &a = (*carried)->sums()[c], &b = replayed->sums()[c];
    EXPECT_NEAR(a.Lag1Correlation(Vector::Zero(10)), b.Lag1Correlation(Vector::Zero(10)), 1e-9);
  }
}

TEST_F(CarriedSums, KeepTheWindowsOfTheRecord) {
  Begin(PolynomialProblem(), PolynomialRows());
  const auto carried = Carried(DesignInside()).value();
  const auto replayed = Replayed(DesignInside());
  ASSERT_EQ(carried->windows().count(), replayed->windows().count());
  for (int w = 0; w < carried->windows().count(); ++w) {
    EXPECT_EQ(carried->windows().span(w).rows, replayed->windows().span(w).rows);
    const auto a = carried->windows().TotalsAt(w, carried->sums());
    const auto b = replayed->windows().TotalsAt(w, replayed->sums());
    const double scale = b[0].g.cwiseAbs().maxCoeff();
    EXPECT_LT((a[0].g - b[0].g).cwiseAbs().maxCoeff(), 1e-9 * scale) << w;
    EXPECT_LT((a[0].b - b[0].b).cwiseAbs().maxCoeff(), 1e-9 * scale) << w;
  }
}

TEST_F(CarriedSums, GoOnAsAfterAReplay) {
  Begin(PolynomialProblem(), PolynomialRows());
  const auto carried = Carried(DesignInside()).value();
  const auto replayed = Replayed(DesignInside());
  RowBlock further = PolynomialRows();
  for (SampleRow& row : further.rows) row.time_s += kStep * kRows;
  ASSERT_TRUE(store_.Append(further).ok());
  ASSERT_TRUE(TakeRows(store_, 2 * kRows, Stop(), *carried).ok());
  ASSERT_TRUE(TakeRows(store_, 2 * kRows, Stop(), *replayed).ok());
  EXPECT_LT((CostsOver(*carried) - CostsOver(*replayed)).cwiseAbs().maxCoeff(), 1e-4);
}

TEST_F(CarriedSums, AreRefusedWithoutAStateToGoOnFrom) {
  Problem problem = PolynomialProblem();
  problem.integration.samples_between_checkpoints = kRows + 1;
  Begin(problem, PolynomialRows());
  EXPECT_EQ(present_->kept_state(), nullptr);
  EXPECT_TRUE(absl::IsFailedPrecondition(Carried(DesignInside()).status()));
}

TEST_F(CarriedSums, AreRefusedWhereTheExpansionIsInaccurate) {
  Problem problem = OscillatorProblem();
  problem.integration.samples_between_checkpoints = kKept;
  const Samples samples = OscillatorRecord(kRows);
  RowBlock block;
  for (const double t : samples.time_s) block.rows.push_back({0, t});
  block.values = samples.columns[0].value;
  block.noise.assign(samples.rows(), 0.02);
  Begin(problem, block);
  ASSERT_NE(present_->kept_state(), nullptr);
  EXPECT_GT(present_->absorbed().OwnError(), 1);
  EXPECT_TRUE(absl::IsFailedPrecondition(Carried(DesignInside()).status()));
}

// An undamped oscillator, whose phase tells ever more of its frequency.
constexpr double kRingingNoise = 0.05, kStiffness = 9.7, kAmplitude = 1.1;

Problem RingingProblem(int64_t interval) {
  Problem problem = OscillatorProblem(kRingingNoise);
  problem.fixed = {{"m", 1}, {"c", 0}};
  problem.integration.samples_between_checkpoints = interval;
  return problem;
}

Samples RingingRecord(int rows) {
  const auto x = [](double t) { return kAmplitude * std::cos(std::sqrt(kStiffness) * t); };
  return Record("x", x, kRingingNoise, rows);
}

struct LeastSquares {
  Vector estimate, deviation;  // of k and x0
};

// Fits x0 cos(√k t) to the record by Gauss and Newton, from the true values.
LeastSquares FitRinging(const Samples& record) {
  LeastSquares fit{Vector{{kStiffness, kAmplitude}}, Vector(2)};
  for (int i = 0; i < 5; ++i) {
    Matrix normal = Matrix::Zero(2, 2);
    Vector right = Vector::Zero(2);
    const double w = std::sqrt(fit.estimate[0]);
    for (size_t r = 0; r < record.rows(); ++r) {
      const double t = record.time_s[r];
      const Vector slope{{-fit.estimate[1] * std::sin(w * t) * t / (2 * w), std::cos(w * t)}};
      normal += slope * slope.transpose();
      right += slope * (record.columns[0].value[r] - fit.estimate[1] * std::cos(w * t));
    }
    fit.estimate += normal.inverse() * right;
    fit.deviation = kRingingNoise * normal.inverse().diagonal().cwiseSqrt();
  }
  return fit;
}

// Counts the rows that are read.
class CountingStore final : public SampleStore {
 public:
  int64_t rows() const override { return samples_.rows(); }
  absl::Status Append(const RowBlock& block) override { return samples_.Append(block); }
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override {
    read_ += count;
    return samples_.Read(first, count, block);
  }
  int64_t TakeCount() { return std::exchange(read_, 0); }

 private:
  MemoryStore samples_;
  mutable int64_t read_ = 0;
};

// Takes the record in batches; returns the estimate and the most rows that a batch made it read.
std::pair<Estimate, int64_t> TakeCounted(const Problem& problem, const Samples& record,
                                         size_t batch) {
  const auto store = std::make_shared<CountingStore>();
  EstimatorOptions options;
  options.store = store;
  const auto estimator = MakeEstimator(problem, options);
  int64_t most = 0;
  for (size_t first = 0; first < record.rows(); first += batch) {
    EXPECT_TRUE(estimator->Append(testing::Rows(record, first, batch)).ok());
    EXPECT_TRUE(estimator->Process().ok());
    const int64_t read = store->TakeCount();
    if (first > 0) most = std::max(most, read);
  }
  return {estimator->CurrentEstimate().value(), most};
}

TEST(CarryOver, BoundsAnUpdateAndGivesTheSamePosterior) {
  constexpr int kCheckpoint = 512, kMany = 60'000, kBatch = 2000;
  const Samples record = RingingRecord(kMany);
  const LeastSquares exact = FitRinging(record);
  const auto [carried, most] = TakeCounted(RingingProblem(kCheckpoint), record, kBatch);
  const auto [replayed, max_replayed] = TakeCounted(RingingProblem(kMany), record, kBatch);
  for (int i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = carried.parameters[static_cast<size_t>(i)];
    EXPECT_NEAR(parameter.map, exact.estimate[i], 1e-3 * exact.deviation[i]);
    EXPECT_NEAR(parameter.std_dev, exact.deviation[i], 1e-3 * exact.deviation[i]);
    // The same windows, but for what the other's own error does to them.
    const double robust = replayed.parameters[static_cast<size_t>(i)].robust_std_dev;
    EXPECT_NEAR(parameter.robust_std_dev, robust, 0.05 * robust);
  }
  EXPECT_GT(carried.expansion.reexpansions, 5);
  // A batch is read once, and a block of it again when the expansion has moved within it. Each move
  // reads the rows since the last checkpoint, twice with the pairs of trajectories; without
  // checkpoints it reads all rows so far.
  EXPECT_LT(most, 2 * kBatch);
  EXPECT_GT(max_replayed, 2 * kBatch);
}

// Filters with so little process noise that the phase tells ever more for a long time. The oracle
// is a prior so narrow that the first expansion is accurate and stays; it is flat, as the other.
TEST(CarryOver, MovesFilters) {
  constexpr int kCheckpoint = 512, kMany = 20'000, kBatch = 2000;
  const Samples record = RingingRecord(kMany);
  Problem problem = RingingProblem(kCheckpoint);
  problem.uncertain[1] = UncertainParameter::Uniform("x0", 0.5, 1.5).value();
  problem.process_noise = {{.state = "v", .spectral_density = 1e-8}};
  const auto [carried, most] = TakeCounted(problem, record, kBatch);
  // Two of them propagate the record again.
  EXPECT_GT(carried.expansion.reexpansions, 3);
  EXPECT_LT(most, 2 * kBatch + 4 * 2 * kCheckpoint);
  for (size_t i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = carried.parameters[i];
    const double far = 10 * parameter.std_dev;
    problem.uncertain[i] =
        UncertainParameter::Uniform(parameter.name, parameter.map - far, parameter.map + far)
            .value();
  }
  const Estimate exact = TakeCounted(problem, record, kBatch).first;
  EXPECT_EQ(exact.expansion.reexpansions, 0);
  for (size_t i = 0; i < 2; ++i) {
    const ParameterEstimate &a = carried.parameters[i], &b = exact.parameters[i];
    EXPECT_NEAR(a.map, b.map, kMaxCarriedShift * b.std_dev);
    EXPECT_NEAR(a.std_dev, b.std_dev, kMaxCarriedShift * b.std_dev);
  }
}

TEST(CarryOver, IsNotDisturbedByStops) {
  const Problem problem = RingingProblem(64);
  const Samples record = RingingRecord(3000);
  const auto store = std::make_shared<StoppingStore>();
  EstimatorOptions options;
  options.store = store;
  const auto estimator = MakeEstimator(problem, options);
  ASSERT_TRUE(estimator->Append(record).ok());
  int stops = 0;
  absl::Status status = absl::CancelledError("");
  for (int reads = 1; absl::IsCancelled(status) && reads < 1000; ++reads) {
    status = estimator->Process(store->StopAfter(reads));
    if (absl::IsCancelled(status)) ++stops;
  }
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_GT(stops, 10);
  ExpectSame(estimator->CurrentEstimate().value(), EstimateOf(problem, record));
}

// The estimate after a streamed input of many knots is the same whether they are forgotten or not,
// and so is one that goes on from a snapshot, for which only the last knots are read again.
TEST(CarryOver, HoldsStreamedInputs) {
  constexpr int kMany = 3072;
  Problem problem = RingingProblem(512);
  problem.fixed = {{"m", 1}, {"c", 0.05}};
  Samples record = RingingRecord(kMany);
  record.columns.push_back({"force", {}, {}});
  for (const double t : record.time_s) record.columns[1].value.push_back(std::sin(2 * t));
  for (const Interpolation interpolation : {Interpolation::kLinear, Interpolation::kCubic}) {
    StreamedInput force;
    force.interpolation = interpolation;
    problem.inputs = {{"force", {force}}};
    Session undisturbed(problem), restored(problem);
    undisturbed.Take(testing::Rows(record, 0, kMany / 2));
    const EstimatorSnapshot snapshot = undisturbed.last;
    undisturbed.Take(testing::Rows(record, kMany / 2, kMany / 2));
    ASSERT_TRUE(restored.estimator->Append(record).ok());
    ASSERT_TRUE(restored.estimator->Restore(snapshot).ok());
    ASSERT_TRUE(restored.estimator->Process().ok());
    ExpectSame(restored.Current(), undisturbed.Current());
  }
}

}  // namespace
}  // namespace polyest::internal::carry_over_test
