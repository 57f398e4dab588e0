#pragma once

// The runs that have ended, without their own parameters: what remains of a campaign with more runs
// than one expansion has room for.
//
// With θ the shared germs and φ_r those of run r, the posterior of θ and the present run needs of
// every ended run only
//   −log L_r(θ) = −log ∫ e^{−J_r(θ, φ)} p(φ)^{α²} dφ,
// with the mismatch J_r of its rows and the α² that the problem gives.
// The run's own parameters follow the shared ones along a path φ̂_r(θ), the minimum of the
// integrand, so that its outputs become functions of θ alone, y_k(θ, φ̂_r(θ)) ≈ c_kᵀφ(η), over a
// region of the shared germs. In these terms the run enters the mismatch sums as any other rows do,
// channel by channel; for a linear model that is the Schur complement H_θθ − H_θφ H_φφ⁻¹ H_φθ. What
// the path leaves out is a polynomial of θ, too,
//   E_r(θ) = −log L_r(θ) − J_r(θ, φ̂_r(θ)),
// which is ½ log |H_φφ(θ)| − α² log p(φ̂_r(θ)) for a Gaussian integrand and found by quadrature
// otherwise (expansion/run_elimination.h). A tempered likelihood has the power of J_r(θ, φ̂_r(θ))
// alone: E_r is, but for a constant, that of a Gaussian integrand of any width. The path has used
// up tr(H_φφ⁻¹ ∂_φᵀ G_c ∂_φ) degrees of freedom of channel c, n_φ in all if the run's parameters
// are identified.
//
// The sums are in units of the noise with which they were taken. An expansion with a revised scale
// rescales them; the path then is no longer the minimum, which changes the sums to second order
// only, as long as the scales differ by less than a quarter. Beyond that the runs are eliminated
// again. Outside the region the polynomials say nothing, and the posterior is kept within it.
//
// Memory: O(S²) numbers for all ended runs together, and for each run its path to first order and
// its spread, n_φ (1 + n_θ + n_φ) numbers, so that it can be eliminated again about another centre.

#include <cstdint>
#include <memory>
#include <vector>

#include "core/bayes/mismatch.h"
#include "core/bayes/population_cost.h"
#include "core/bayes/region.h"
#include "core/bayes/window_sums.h"
#include "core/chaos/basis.h"
#include "core/common/types.h"
#include "polyest/problem.h"

namespace polyest::internal {

// The posterior of an ended run's own parameters given the shared ones, in germ coordinates:
// φ = centre + slope (ξ − ξ_0) ± spread, ξ_0 the centre of EndedRuns::region.
struct RunPath {
  Vector centre;  // n_φ
  Matrix slope;   // n_φ × n_θ
  Matrix spread;  // n_φ × n_φ; spread spreadᵀ is the covariance
};

struct EndedRuns {
  // The rows of the record that belong to ended runs: the first `rows`.
  int64_t rows = 0;
  int64_t sample_count = 0;  // over all channels
  std::vector<int> run;      // the runs, ascending
  std::vector<int64_t> first_row;
  Matrix paths;  // a column for each run, see Path

  // The posterior of the shared germs when the region was chosen.
  Vector centre;  // n_θ
  Matrix factor;  // n_θ × n_θ; factor factorᵀ is the covariance

  Region region = Region::WholePrior(1);  // of the shared germs
  std::shared_ptr<const Basis> basis;     // Legendre polynomials over the region, S terms

  // What the rows of the ended runs add, with the meanings that AbsorbedRows gives these names
  // (expansion/absorbed_rows.h); the sums are about the region's centre, in the basis.
  std::vector<ChannelSums> sums;
  Vector discount;
  double own_error = 0;
  double log_noise = 0, log_variance = 0;
  std::vector<int64_t> outliers;
  Vector largest;

  // For runs that share a population: the shape of each one's posterior of its score about the
  // path's mean (bayes/population_cost.h), and the slope (n_θ, germ coordinates) of what that
  // leaves out of the cost, over all runs. Empty and 0 without a population.
  std::vector<ScoreMixture> shapes;
  Vector left_out;
  // Sum over those of its runs that no expansion follows: the square of the error in units of the
  // noise, and 1 where the score was not found within the region of the expansion.
  double unresolved = 0;

  Vector remainder;  // coefficients of Σ_r E_r, S
  // By channel, the noise with which the sums were taken: ChannelNoise::scale, time_constant_s and
  // white_share.
  Vector noise_scale, noise_time_constant_s, noise_white_share;

  // The sums of windows of runs, one run a row, with the remainder as a channel of its own after
  // the others (SumsWithRemainder). Without any if the runs share a population.
  WindowSums windows;

  int own_parameters() const;    // n_φ
  RunPath Path(size_t i) const;  // of run run[i]
  void SetPath(size_t i, const RunPath& path);
  // Appends the rows [first, end) of a run and its path.
  void Append(int run_index, int64_t first, int64_t end, const RunPath& path);
};

// Returns the sums of the channels as windows take them (window_sums.h): with the kinds of noise of
// `measured` and, as the last channel, one without samples whose log variance is the remainder.
std::vector<ChannelSums> SumsWithRemainder(const std::vector<MeasuredOutput>& measured,
                                           const EndedRuns& ended);

// Returns the polynomials' terms at the region's centre (S).
Vector TermsAtCentre(const EndedRuns& ended);

// Whether all parts of what was read from a snapshot have their sizes and are finite, for n_θ
// shared and n_φ own parameters.
bool IsWellFormed(const EndedRuns& ended, int shared, int own, int channels);

}  // namespace polyest::internal
