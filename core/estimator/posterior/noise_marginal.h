#pragma once

// The posterior with the correlation of noise that is learned integrated out.
//
// A cost takes the learned time constant τ and white share f as known, which makes the posterior of
// a short record too narrow. Integrated over the noises m of a channel's profile
// (correlation_profile.h) with prior probabilities p_m, and over an unknown scale, the likelihood
// is
//   L = Σ_m p_m e^{−L_m(δ)},   L_m = ½ N log χ²_m(δ) + D_m   (½ χ²_m + D_m if the scale is known),
// and draws of the cost's posterior get the factor L e^{L_0(δ)} for the present noise 0. The χ²_m
// are those of the residuals linearized at η_c, at δ = η − η_c. Where the model is curved, δ is
// shortened towards the minimum until the linearized χ² of the present noise is not above that of
// the expansion: L depends on the direction by the first order, on the distance by the model.
//
// The prior of the noise: white noise, correlated noise with a uniform density of log τ over the
// grid, and noise that is white in part with a uniform density of log τ and log f/(1 − f), with the
// probabilities 1/6, 4/6 and 1/6. The integrals are sums over the grid; the present noise, or its
// neighbours, refine it where the likelihood is narrower than its steps.
//
// Source: Berger, De Oliveira, Sansó, Objective Bayesian analysis of spatially correlated data,
// Journal of the American Statistical Association 96 (2001) 1361–1374.

#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/posterior/posterior_draws.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns the prior probabilities of the profile's members, in their order, Σ = 1; 0 for members
// that others stand for.
Vector NoiseProbabilities(const CorrelationProfile& profile, const TimeConstantGrid& grid);

class NoiseMarginal {
 public:
  // Takes what the expansion has learned. `expansion` must outlive the marginal.
  NoiseMarginal(const ResolvedProblem& problem, const RegionalExpansion& expansion);

  // Whether no channel's correlation has been learned from a profile.
  bool empty() const { return channels_.empty(); }
  // Returns the logarithms of the draws' factors, up to a common constant. `etas` is draws × n,
  // local coordinates of the expansion.
  Vector LogFactors(const ConstMatrixRef& etas) const;

 private:
  struct Channel {
    const ChannelSums* sums = nullptr;
    // The coefficients of χ² for the present noise, as a function of the products of any two of
    // (δ, −1), and its minimum in δ.
    Vector present;
    Vector minimum;
    // The noises that matter: D_m − log p_m, and the coefficients of χ²_m as columns.
    Vector heights;
    Matrix grams;
  };

  void Add(const ChannelSums& sums, const CorrelationProfile& profile, const TimeConstantGrid& grid,
           const Matrix& unit);
  void AddFactors(const Channel& channel, Matrix deltas, const Vector& chi_squared,
                  const Vector& lags, VectorRef factors) const;

  const RegionalExpansion& expansion_;
  std::vector<Channel> channels_;
};

// Gives the draws of the cost's posterior on the expansion the factors of the marginal; draws again
// from a wider density where too few are left, or a few weigh too much. Returns the factors by
// which the widths of the scores' 95 % intervals (n) change, 1 where nothing is integrated out.
// Returns an error only on a stop request.
absl::StatusOr<Vector> MarginalizeNoise(const ResolvedProblem& problem,
                                        const RegionalExpansion& expansion, const Cost& cost,
                                        const Matrix& guesses, const PosteriorEffort& effort,
                                        const Stop& stop, PosteriorDraws& draws);

}  // namespace polyest::internal
