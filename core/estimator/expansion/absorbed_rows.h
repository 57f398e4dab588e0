#pragma once

// What an expansion keeps of the rows that it has absorbed.

#include <cstdint>
#include <optional>
#include <vector>

#include "core/bayes/mismatch.h"
#include "core/bayes/outlier_density.h"
#include "core/bayes/relative_samples.h"
#include "core/bayes/robust_samples.h"
#include "core/bayes/window_sums.h"
#include "core/common/types.h"
#include "core/estimator/record/correlation_profile.h"
#include "core/estimator/record/residual_blocks.h"

namespace polyest::internal {

// While channels with outliers or relative noise have few samples: these, and what AbsorbedRows has
// under the same names, with their likelihood in place of that of weighted or scored samples
// (bayes/robust_samples.h, bayes/relative_samples.h). Other channels have the same in both.
struct SampleBySample {
  std::vector<RobustSamples> channels;    // per channel; those that keep none have no outliers
  std::vector<RelativeSamples> relative;  // per channel
  double own_error = 0;
  double log_noise = 0, log_variance = 0;
  Matrix check_chi_squared;  // C × m; for a channel with outliers 2 Σ ρ, as below
  Vector check_residual;
  Matrix point_chi_squared;  // Q × m
  // Σ log(R/R⁰) at the check points (C × m) and the collocation points (Q × m); 0 for channels of
  // other noise.
  Matrix check_log_variance, point_log_variance;
  Vector largest;  // per channel of relative noise: the largest |z|
};

// What the sums are of: S terms, m channels, and Q collocation, C check and K control points.
struct AbsorbedSizes {
  int terms = 0, channels = 0;
  int points = 0, check_points = 0, controls = 0;
};

// The accumulated contributions of the rows that an expansion has absorbed.
struct AbsorbedRows {
  // Starts from zero.
  explicit AbsorbedRows(const AbsorbedSizes& sizes = {});

  // Returns the sum of the squares of the expansion's own error in units of the noise, Σ ρ_k/R_k.
  double OwnError() const { return few ? few->own_error : own_error; }
  // Returns the term that makes the costs of different expansions of the same record comparable,
  // each with its own noise and outlier weights: Σ ½ log R_k, and what the reweighting leaves out
  // of the likelihood. R is taken with the expansion's own error, as in the sums, or without it.
  double LogNormalization(bool with_own_error) const;
  // Returns the samples of a channel with outliers, or of relative noise, while they are kept; null
  // without any.
  const RobustSamples* KeptSamples(int channel) const;
  const RelativeSamples* KeptRelative(int channel) const;
  // Returns χ² of a channel's samples at d = φ(η) − φ(η_0), with the noise of the predictions there
  // while they are kept.
  double ChiSquaredAt(int channel, const ConstVectorRef& d) const;
  // Returns χ² of the model itself at the collocation points, Q × m, and at the check points, C ×
  // m: what the sums say of the expansion there, or what has the same likelihood as samples that
  // are kept. Not finite where a trajectory could not be integrated.
  Matrix PointChiSquared() const;
  Matrix CheckChiSquared() const;

  int64_t rows = 0;
  int64_t sample_count = 0;       // over all channels
  int64_t propagated = 0;         // trajectories × rows
  std::vector<ChannelSums> sums;  // per channel, over all runs
  WindowSums windows;             // the sums by windows of the record; none after ended runs
  Vector discount;                // per channel: Σ ρ_k/R_k, with ρ divided by the misfit
  double own_error = 0;           // Σ ρ_k/R_k over all channels, with ρ as it is
  // The part of `own_error` that was taken over from an expansion over another region, and what
  // each further sample adds to it because of the states taken over (carry_over.h).
  double carried_error = 0;
  double carried_rate = 0;
  double log_noise = 0;     // Σ ½ log σ² + what outliers' weights leave out of the likelihood
  double log_variance = 0;  // as log_noise, with R in place of σ²
  std::vector<int64_t> outliers;  // per channel
  // Per channel: the density of the samples that have been weighed as outliers are, at the centre
  // at which they were.
  std::vector<OutlierDensity> densities;
  // Each channel's previous sample in units of its noise; zero at the beginning of a run.
  int summed_run = -1;
  Matrix previous_coefficients;  // S × m
  Vector previous_error;
  std::vector<CorrelationProfile> profiles;  // per channel; empty unless its correlation is learned
  std::vector<ResidualBlocks> blocks;  // per channel; since sums were carried over, if they were
  Vector largest;  // per channel: largest |z| of the rows propagated, for relative noise
  // Sums at the check points.
  Matrix check_chi_squared;       // C × m
  Vector check_residual;          // Σ ((model − expansion)/σ)²
  std::vector<bool> check_valid;  // whether the trajectory could be integrated
  // χ² of the model itself at the collocation points, Q × m, with the variances R of the sums; not
  // finite where the trajectory could not be integrated. With filters, Σ log(S/σ²) is included,
  // here and at the check points.
  Matrix point_chi_squared;
  Vector point_log_variance;        // Q: ½ Σ log(S/σ²) with filters, discounted; empty without
  Matrix control_scores;            // S × (K · m), column i · m + c (control_trajectories.h)
  std::vector<bool> control_valid;  // whether the trajectory could be integrated; K
  // What counts in place of the above; nothing without outliers, or from where their samples are
  // no longer few.
  std::optional<SampleBySample> few;
};

}  // namespace polyest::internal
