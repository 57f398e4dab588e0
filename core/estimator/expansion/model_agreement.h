#pragma once

// The agreement of an expansion with the model itself, as its check points show it.

#include <optional>

#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// Returns J_mismatch of the model itself at a point with the basis difference d (cost.h) from its
// χ² of each channel (m), at the expansion's lag-1 correlation.
double ModelMismatch(const RegionalExpansion& expansion, const ConstVectorRef& d,
                     const ConstVectorRef& chi_squared);

// Returns √(β Σ ρ_k/R_k), by Cauchy–Schwarz the largest shift of a posterior mean, in its standard
// deviations, that the residuals of the expansion at its collocation points allow; β is `power`,
// that of the likelihood. β times the rounding error of the sums is added, which scatters the cost
// from point to point, and with filters β times the error of ½ Σ log(S/σ²).
double LargestShift(const RegionalExpansion& expansion, double power);
// An expansion whose LargestShift at the power 1 is at most this is as good as the model, all over
// its region.
inline constexpr double kNegligibleShift = 0.01;

// What the check points say that could be integrated and have a finite cost, C' of them.
struct CheckDifferences {
  Matrix etas;    // C' × n, local coordinates
  Vector totals;  // J of the expansion
  Vector
      log_weights;  // log of e^{−J} over the density that they were drawn from, J of the expansion
  Vector differences;  // ΔJ = J_mismatch of the model − of the expansion, times the cost's power
  Vector residuals;    // root mean square of (model − expansion)/σ, times the root of the power
};
CheckDifferences DifferencesAtChecks(const RegionalExpansion& expansion, const Cost& cost);

// How accurate the posterior on the expansion is, judged at the check points. To first order the
// error of a posterior mean, in units of its standard deviation, is bounded by each of
//   the standard deviation over the posterior of ΔJ = J_mismatch of the model − of the expansion
//   (at the expansion's lag-1 correlation, where that enters; times the power of the likelihood),
//   ‖(model − expansion)/σ‖ √((1 + r)/(1 − r)) over the samples, r the lag-1 correlation of the
//   residuals at the minimum of the cost if that is more than chance; of the fit itself if there
//   are no check points; with filters, plus the error of ½ Σ log(S/σ²).
// Both bounds follow from the Cauchy–Schwarz inequality, over particles and over samples. The first
// is sharper but needs check points where the posterior is. The second holds wherever they are. Its
// factor counts where residuals are not noise but a misfit, which may look like the error of the
// expansion: N samples then tell no more than N (1 − r)/(1 + r) independent ones. The first bound
// is then left out unless a check point lies within √n + 2 standard deviations of the mode. Of sums
// taken over from an expansion over another region, the check points know nothing; the first bound
// is increased by √(β Σ ρ_k/R_k) of those, and the second contains it (carry_over.h).
struct Agreement {
  // The smaller of the available bounds, with β times the rounding error of the sums; ≥ 0.
  double shift = 0;
  // Mean of ΔJ over the posterior, if the check points determine it to 0.25: the change of the
  // cost's height that the expansion's own error and its discount cause.
  std::optional<double> mean_difference;
  // Largest root mean square of (model − expansion)/σ over the check points of non-negligible
  // weight.
  double residual_to_noise = 0;
};

// Returns the agreement of the expansion with the model. `cost` is the cost on the expansion.
Agreement AgreementWithModel(const RegionalExpansion& expansion, const Cost& cost);

}  // namespace polyest::internal
