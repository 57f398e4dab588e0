#pragma once

// What a run that has ended says of the normal score g of a parameter that shares a population
// (population_cost.h): its likelihood L(g) on a grid, and its posterior L(g) N(g; 0, 1) as a
// mixture of Gaussians, which a population can be integrated against in closed form.

#include "core/bayes/population_cost.h"
#include "core/common/types.h"

namespace polyest::internal {

// L between and beyond the nodes of an equidistant grid: between them by cubic interpolation of its
// logarithm, beyond them by the parabola at the last ones, which never rises outwards.
class ScoreLikelihood {
 public:
  // `log_likelihood` (at least 4 values) is log L, up to a constant, at first, first + step, …;
  // `step` > 0. A value 300 below the largest, or not a finite number, counts as 300 below it: if
  // there is no finite one, nothing is known.
  ScoreLikelihood(double first, double step, Vector log_likelihood);

  double LogAt(double g) const;
  // Returns mean and variance of the posterior L(g) N(g; 0, 1), by the trapezoidal rule.
  const RunScore& posterior() const { return posterior_; }
  // Returns −log ∫ L(g) N(g; population) dg, by the trapezoidal rule; +∞ if the integrand vanishes.
  double NegativeLogEvidence(const RunScore& population) const;
  // Returns the posterior as a mixture: no components if it is a Gaussian, to 10⁻³ of its density
  // within 4 standard deviations.
  //
  // Otherwise the components have the same width ω as their distance, 0.25 standard deviations, so
  // that a smooth density is their sum to 10⁻⁸. Their weights are found by the iteration of
  // W. H. Richardson (J. Opt. Soc. Am. 62 (1972) 55) and L. B. Lucy (Astron. J. 79 (1974) 745),
  //   w_k ← w_k Σ_j K_jk p_j/(K w)_j,
  // which keeps them positive and corrects ratios: the tails, in which a population joins runs that
  // say little, are as good as the middle.
  ScoreMixture Mixture() const;

 private:
  bool IsGaussian() const;
  Vector Centres() const;
  double LogPosterior(double g) const { return LogAt(g) - 0.5 * g * g - log_evidence_; }

  double first_;
  double step_;
  Vector log_;
  double greatest_ = 0;      // of log_
  double log_evidence_ = 0;  // log ∫ L(g) e^{−g²/2} dg
  RunScore posterior_;
};

}  // namespace polyest::internal
