// The axis across which an element is bisected.

#include "core/estimator/posterior/bisection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "core/estimator/expansion/reexpansion.h"
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

}  // namespace
}  // namespace polyest::internal::bisection_test
