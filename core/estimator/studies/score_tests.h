#pragma once

// Score tests of what a problem holds fixed: whether the residuals of an estimate ask for another
// value of a fixed parameter, initial state, gain, delay or offset. Such an error can move the
// estimate by many standard deviations although the residuals are hardly larger than the noise.
//
// At the minimum of the cost let r = (z − y)/σ be the residuals in units of their noise, S =
// ∂(y/σ)/ ∂ξ the sensitivities to the uncertain parameters, P and b the curvature of α² J_apriori
// and minus its gradient there, A = SᵀS + P, and g = ∂(y/σ)/∂q for a fixed quantity q. Then
//
//   s = gᵀ(r − S A⁻¹(Sᵀr + b)) ÷ √v,  v = gᵀg − gᵀS A⁻¹ Sᵀg,
//
// is standard normal if q is right. If not, q is off by s/√v ± 1/√v, and the estimate by
// −A⁻¹ Sᵀg s/√v. The derivatives are differences of trajectories that share their steps. Correlated
// noise is whitened first.
//
// Source: Rao, Large sample tests of statistical hypotheses concerning several parameters,
// Mathematical Proceedings of the Cambridge Philosophical Society 44 (1948) 50–57.

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/learned_noise.h"
#include "polyest/estimate.h"
#include "polyest/samples.h"
#include "polyest/stop.h"

namespace polyest::internal {

// A score from which on a fixed quantity is doubted.
inline constexpr double kMinScore = 5;

// What the residuals say of a fixed quantity.
struct ScoreTest {
  std::string name;
  std::string unit;
  double value = 0;        // that it is held at
  double change = 0;       // s/√v: by how much the residuals ask the value to change
  double deviation = 0;    // of the change, 1/√v
  double score = 0;        // s
  Vector shifts = {};      // of the estimate with that change, in its standard deviations (n)
  Vector parameters = {};  // the estimate with that change (n)
};

// What the model does with such a change.
struct Correction {
  double chi_squared_before = 0, chi_squared = 0;  // of all channels, without and with it
  double dispersion = 1;  // of the residuals that are left (residual_scatter.h)
};

struct FixedValueTests {
  std::vector<ScoreTest> scores;         // the largest |s| first
  std::optional<Correction> correction;  // of the first, if its |s| is kMinScore at least
};

// Tests fixed quantities (fixed_quantities.h), as many as a block of trajectories has room for,
// over the first 65,536 rows at most. A quantity is left out if the model fails with another value
// of it, or if the uncertain parameters can do what it does, but for a thousandth.
//
// There are no tests of a problem with filters, with parameters of runs, with outliers handled or
// relative noise, or with a model that simulates itself; nor if the estimate is no minimum within
// two standard deviations. `learned` is the noise with which the record has been weighed; where its
// size is unknown, that of the residuals takes its place. Returns an error only on a stop request,
// or of the store.
absl::StatusOr<FixedValueTests> TestFixedQuantities(const ResolvedProblem& problem,
                                                    const SampleStore& store, int64_t rows,
                                                    const std::vector<ChannelNoise>& learned,
                                                    const Estimate& estimate, const Stop& stop);

}  // namespace polyest::internal
