// The axis across which an element is bisected.

#include "core/estimator/posterior/bisection.h"

#include <absl/status/status.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "core/estimator/expansion/replay.h"
#include "core/estimator/posterior/least_linear.h"
#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/record/memory_store.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::bisection_test {
namespace {

constexpr double kNoise = 0.1;
constexpr Eigen::Index kFrequency = 2;

// A decaying cosine that is first seen when its frequency has long decided its phase.
Problem LateCosine() {
  Problem problem = TextProblem("(a + b*t)*exp(-c*t)*cos(2*pi*f*t)",
                                {UncertainParameter::Normal("a", 1, 0.12).value(),
                                 UncertainParameter::Uniform("c", 0.01, 0.08).value(),
                                 UncertainParameter::Uniform("f", 0.6, 1.3).value(),
                                 UncertainParameter::Normal("b", 0, 0.02).value()},
                                kNoise);
  problem.expansion.order = 3;
  return problem;
}

// Returns the normal of the cut after one row.
Vector NormalOfCut(double time_s, double value) {
  const ResolvedProblem problem = ResolvedProblem::Make(LateCosine()).value();
  RowBlock block;
  block.rows.push_back({0, time_s});
  block.values = {value};
  block.noise = {kNoise};
  MemoryStore store;
  EXPECT_TRUE(store.Append(block).ok());
  const auto expansion = Replay(problem, DesignForPrior(problem).value(),
                                NoiseToBeginWith(problem.problem()), store, 1, 1, Stop())
                             .value();
  std::optional<Eigen::Index> germ;
  if (!HasTermsOfTheModel(*expansion)) {
    germ = FindLeastLinear(problem, *expansion, store, 1, 1, Stop()).value().germ;
  }
  const std::vector<Piece> halves = Bisect(*expansion, germ, Matrix(0, problem.dimension()));
  EXPECT_EQ(halves.size(), 2U);
  EXPECT_TRUE(halves[0].element.bounds()[0].IsOpposite(halves[1].element.bounds()[0]));
  return halves[0].element.bounds()[0].normal;
}

// From a third of a turn between the ends of the prior, which the order resolves, to four, of which
// its terms say nothing.
TEST(Bisection, CutsTheFrequencyHoweverLateTheSignalIsSeen) {
  for (const double time_s : {0.5, 1.0, 2.0, 3.0, 4.5, 6.0}) {
    for (const double value : {-0.6, 0.0, 0.3, 0.8}) {
      const Vector normal = NormalOfCut(time_s, value);
      EXPECT_NE(normal[kFrequency], 0);
      EXPECT_EQ(normal.cwiseAbs().sum(), std::abs(normal[kFrequency]))
          << "t = " << time_s << ", y = " << value;
    }
  }
}

// y = a cos(300 f) over a region in which no axis is that of f, with one row.
class ObliqueRegion : public ::testing::Test {
 protected:
  static constexpr Eigen::Index kFrequencyOfTwo = 1;

  void SetUp() override {
    RowBlock block;
    block.rows.push_back({0, 1});
    block.values = {0.3};
    block.noise = {kNoise};
    ASSERT_TRUE(store_.Append(block).ok());
    Matrix axes(2, 2);
    axes << 0.5, -0.4, 0.3, 0.2;
    Region region(Vector::Constant(2, 0.1), axes);
    expansion_ = Replay(problem_, DesignForRegion(problem_, Truncation{}, region, region.centre()),
                        NoiseToBeginWith(problem_.problem()), store_, 1, 1, Stop())
                     .value();
  }

  const ResolvedProblem problem_ =
      ResolvedProblem::Make(TextProblem("a*cos(300*f)",
                                        {UncertainParameter::Normal("a", 1, 1).value(),
                                         UncertainParameter::Uniform("f", 0, 1).value()},
                                        kNoise))
          .value();
  MemoryStore store_;
  std::unique_ptr<RegionalExpansion> expansion_;
};

TEST_F(ObliqueRegion, IsLeastLinearInTheFrequency) {
  EXPECT_FALSE(HasTermsOfTheModel(*expansion_));
  const LeastLinear found = FindLeastLinear(problem_, *expansion_, store_, 1, 1, Stop()).value();
  EXPECT_EQ(found.germ, kFrequencyOfTwo);
  EXPECT_EQ(found.propagated_rows, 2 * 4 * 6);
}

TEST_F(ObliqueRegion, IsCoveredByItsHalves) {
  const Region whole = expansion_->design().region;
  const std::vector<Piece> halves = Bisect(*expansion_, kFrequencyOfTwo, Matrix(0, 2));
  double lengths = 0;
  for (const Piece& half : halves) lengths += half.region.axes().row(1).cwiseAbs().sum();
  EXPECT_NEAR(lengths, whole.axes().row(1).cwiseAbs().sum(), 1e-12);
  for (double x = -1; x <= 1; x += 0.25) {
    for (double y = -1; y <= 1; y += 0.25) {
      const Vector xi = whole.ToGerm(Eigen::Vector2d(x, y));
      for (const Piece& half : halves) {
        if (!half.element.Contains(xi)) continue;
        EXPECT_LE(half.region.ToLocal(xi).cwiseAbs().maxCoeff(), 1 + 1e-12) << xi.transpose();
      }
    }
  }
}

// A store whose rows cannot be read any more, with the code that an infeasible expansion has, too.
class LostStore final : public SampleStore {
 public:
  int64_t rows() const override { return 1; }
  absl::Status Append(const RowBlock& /*block*/) override { return absl::OkStatus(); }
  absl::Status Read(int64_t /*first*/, int64_t /*count*/, RowBlock& /*block*/) const override {
    return absl::FailedPreconditionError("the store has been closed");
  }
};

TEST_F(ObliqueRegion, IsNotSearchedWhereTheStoreFails) {
  const auto found = FindLeastLinear(problem_, *expansion_, LostStore(), 1, 1, Stop());
  EXPECT_EQ(found.status(), absl::FailedPreconditionError("the store has been closed"));
}

TEST(LeastLinear, IsNoParameterOfALinearModel) {
  const ResolvedProblem problem =
      ResolvedProblem::Make(TextProblem("a + 3*b",
                                        {UncertainParameter::Normal("a", 0, 1).value(),
                                         UncertainParameter::Uniform("b", 0, 1).value()},
                                        kNoise))
          .value();
  RowBlock block;
  block.rows.push_back({0, 1});
  block.values = {0.3};
  block.noise = {kNoise};
  MemoryStore store;
  ASSERT_TRUE(store.Append(block).ok());
  const auto expansion = Replay(problem, DesignForPrior(problem).value(),
                                NoiseToBeginWith(problem.problem()), store, 1, 1, Stop())
                             .value();
  EXPECT_FALSE(FindLeastLinear(problem, *expansion, store, 1, 1, Stop()).value().germ);
}

}  // namespace
}  // namespace polyest::internal::bisection_test
