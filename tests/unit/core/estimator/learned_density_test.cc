// Tests what is said of a process noise whose density is learned where there is none: the posterior
// averages over the densities that the record allows, and of the density only a limit is known. The
// oracle is the exact likelihood on a grid of densities (forced_oscillator.h).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/estimator/forced_oscillator.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

constexpr double kLower = 1e-7, kUpper = 1;

// Cells of a grid of the density's logarithm over a log-uniform prior.
constexpr int kCells = 80;
const double kCellWidth = std::log(kUpper / kLower) / kCells;
double LogarithmOf(double cell) { return std::log(kLower) + cell * kCellWidth; }

// What the record leaves for each density: of k and c a Gaussian, since their priors are flat and
// wide.
struct Grid {
  Matrix means{kCells, 2}, deviations{kCells, 2};
  Vector weights{kCells};  // of the cells, Σ = 1
};

Grid GridOf(const Samples& samples) {
  Grid grid;
  Vector guess{{kTrueK, kTrueC}};
  for (int cell = 0; cell < kCells; ++cell) {
    const auto cost = [&](const Vector& at) {
      return ExactCost(samples, {at[0], at[1], LogarithmOf(cell + 0.5)});
    };
    const Maximum found = Minimize(cost, guess, Vector{{0.02, 0.004}});
    guess = found.at;
    grid.means.row(cell) = found.at;
    grid.deviations.row(cell) = found.std_dev;
    grid.weights[cell] = found.log_volume - found.cost;
  }
  grid.weights = (grid.weights.array() - grid.weights.maxCoeff()).exp();
  grid.weights /= grid.weights.sum();
  return grid;
}

// Returns the 97.5 % quantile of the density's logarithm.
double UpperLogarithm(const Grid& grid) {
  double below = 0;
  for (int cell = 0; cell < kCells; ++cell) {
    const double missing = 0.975 - below;
    if (grid.weights[cell] >= missing) return LogarithmOf(cell + missing / grid.weights[cell]);
    below += grid.weights[cell];
  }
  return std::log(kUpper);
}

// The tolerances are for the draws, which tell means and standard deviations to about 1 %, and for
// the error of an expansion of order 5. At the default order the means may be off by up to the
// shift at which an expansion is settled again, 0.08 standard deviations (kMaxShift of
// mixture_component.cc).
TEST(LearnedDensity, IsAveragedOverWhereThereIsNoProcessNoise) {
  const Samples samples = Measure(400, 0, 2);
  const Grid grid = GridOf(samples);
  const Vector mean = grid.means.transpose() * grid.weights;
  const Vector square =
      (grid.means.cwiseAbs2() + grid.deviations.cwiseAbs2()).transpose() * grid.weights;
  const Vector std_dev = (square - mean.cwiseAbs2()).cwiseSqrt();
  Problem problem = ForcedOscillator();
  problem.process_noise = {{.state = "v", .unknown = true, .lower = kLower, .upper = kUpper}};
  const Estimate estimate = EstimateOf(problem, samples);
  problem.expansion.order = 5;
  const Estimate fine = EstimateOf(problem, samples);
  // Whether an expansion of the default order holds depends on where the draws have led it. Where
  // it is called inaccurate, its uncertainty is the wider.
  const bool inaccurate = Has(estimate, DiagnosticCode::kExpansionInaccurate);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = fine.parameters[static_cast<size_t>(i)];
    EXPECT_NEAR(parameter.mean, mean[i], 0.05 * std_dev[i]) << parameter.name;
    EXPECT_NEAR(parameter.posterior_std_dev, std_dev[i], 0.05 * std_dev[i]);
    const ParameterEstimate& at_default = estimate.parameters[static_cast<size_t>(i)];
    const double deviation = at_default.posterior_std_dev;
    EXPECT_NEAR(at_default.mean, mean[i], (inaccurate ? 0.5 : 0.08) * std_dev[i]) << parameter.name;
    EXPECT_GT(deviation, 0.95 * std_dev[i]);
    EXPECT_LT(deviation, (inaccurate ? 1.25 : 1.05) * std_dev[i]);
  }
  // The cost hardly depends on densities below the limit, so that its curvature says nothing, and
  // where its minimum lies is a matter of rounding. A standard deviation that contradicts that of
  // the draws by a factor of 2 is replaced by it (kContradiction of diagnosis.h).
  const ParameterEstimate& density = fine.parameters[2];
  EXPECT_NEAR(std::log(density.upper95), UpperLogarithm(grid), 0.1);
  EXPECT_LE(density.std_dev, 2 * density.posterior_std_dev);
  EXPECT_GE(density.std_dev, 0.5 * density.posterior_std_dev);
  EXPECT_NEAR(fine.covariance(2, 2), std::pow(density.std_dev, 2),
              1e-9 * std::pow(density.std_dev, 2));
  const bool replaced = density.std_dev == density.posterior_std_dev;
  EXPECT_THAT(
      Message(fine, DiagnosticCode::kNonGaussian),
      HasSubstr(replaced ? "what is reported is the posterior's"
                         : "go by the posterior's own mean, standard deviation and interval"));
  EXPECT_FALSE(Has(fine, DiagnosticCode::kMultipleMinima));
}

}  // namespace
}  // namespace polyest::internal
