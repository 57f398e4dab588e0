#pragma once

// The prior of parameters of runs that share a population, as a term of the cost (cost.h).
//
// Run r's parameter has the normal score g_r. Everything else takes g_r for a germ of its own,
// standard normal as those of other runs' parameters. In a population it is N(μ, s²), with
//   μ = ξ_mean,   log s = log s_0 + τ ξ_spread,
// so that each run adds −log N(g; μ, s²)/N(g; 0, 1). A run that has been eliminated has the
// posterior p(g) under the standard normal prior, a mixture Σ_k w_k N(g; c_k, S), where the c_k are
// affine in the other germs, and adds (D. Lunn and others, Applied Statistics 62 (2013) 551, with
// draws in place of a mixture)
//   −log ∫ p(g) N(g; μ, s²)/N(g; 0, 1) dg = −log Σ_k w_k e^{−f(c_k)},
//   f(c) = ½ ( log w + [(1 − S)(c − μ)² + S (2c² − 2cμ − s²c²)]/w − c² ),   w = S + (1 − S) s².
// That holds for a run that is still expanded, too: it has one component with S = 0, and c is its
// germ. So every run is a term of the same sum, and nothing is lost where its own data say little
// (S → 1) or everything (S → 0). Among the germs the outputs depend on, only g_r is new; μ and s
// have no part in the expansion of the outputs, and s may be as small as it likes.

#include <iterator>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

// The normal score of a run's parameter under the population.
struct RunScore {
  double mean = 0;
  double variance = 0;
};

// The shape of a run's posterior about its mean: Gaussians of the same width `step` at the offsets
// first, first + step, … from it. Without components it is one Gaussian.
struct ScoreMixture {
  static constexpr int kMaxComponents = 96;

  double first = 0;
  double step = 0;
  Vector log_weights;  // of the components; the weights' sum is 1
};

// Returns the posterior of a run's score in the population N(mean, variance), given that it is
// N(c, S) under the standard normal prior; 0 < S ≤ 1.
RunScore InPopulation(const RunScore& alone, const RunScore& population);

// Returns the quantile of that posterior, 0 < probability < 1, of a run whose posterior under the
// standard normal prior has the mean and variance `alone` and a shape.
double QuantileInPopulation(const RunScore& alone, const ScoreMixture& shape,
                            const RunScore& population, double probability);

class PopulationCost {
 public:
  struct Derivatives {
    double value = 0;
    Vector gradient;  // n
    Matrix hessian;   // n × n
  };
  // A run counts as a Gaussian, whatever its shape, if the standard deviation √S of its posterior
  // is below this part of s. That leaves out the third cumulant's term of −log ∫ p(g) N(g; μ,
  // s²)/N(g; 0, 1) dg, γ (√S/s)³ (u³ − 3u)/6 with the skewness γ and u = (c − μ)/s. It is below
  // 10⁻⁴ for |u| < 3 and |γ| < 1.
  static constexpr double kNarrow = 0.03;
  // The median of s and the standard deviation of its logarithm in its prior: 95 % of it lies
  // within a factor of 7 of the median. The stated prior has to cover where the population is and
  // how wide it is, so that the population is probably narrower than it, but may be wider where the
  // prior was stated too narrow. Lognormal, so that its germ is normal and s = 0 is no edge.
  static constexpr double kMedianSpread = 0.5;  // s_0
  static constexpr double kLogDeviation = 1;    // τ

  // `mean` and `spread` are the indices of their germs. Row r of `slope` (R × n) and `base` are
  // run r's mean base + slope ξ, and `variance` (R) is S of a Gaussian, 0 ≤ S ≤ 1. The first runs
  // have the given shapes, those that have ended; the others are Gaussians.
  PopulationCost(int mean, int spread, Vector base, Matrix slope, Vector variance,
                 std::vector<ScoreMixture> shapes = {});

  // `power` is that of the likelihood, of which the terms of the runs that have ended are a part.
  double Evaluate(const ConstVectorRef& xi, double power = 1) const;
  Derivatives Differentiate(const ConstVectorRef& xi, double power = 1) const;
  // Returns N(μ, s²) at germs ξ.
  RunScore PopulationAt(const ConstVectorRef& xi) const;

 private:
  const ScoreMixture* ShapeOf(Eigen::Index run, const RunScore& population) const;
  // Returns the power of a run's term, given that of the likelihood.
  double PowerOf(Eigen::Index run, double power) const {
    return run < std::ssize(shapes_) ? power : 1;
  }

  int mean_;
  int spread_;
  Vector base_;
  Matrix slope_;
  Vector variance_;
  std::vector<ScoreMixture> shapes_;
};

// Returns N(μ, s²) of the two germs.
RunScore PopulationOfGerms(double mean, double spread);

}  // namespace polyest::internal
