#pragma once

// The robust (sandwich) covariance of an estimate, from the scores of the record's windows:
//   H⁻¹ (Σ_w g_w g_wᵀ) H⁻¹
// is right even where residuals are larger than the noise or correlated, so long as the correlation
// is short compared with the windows (P. Huber, "The behavior of maximum likelihood estimates under
// nonstandard conditions", Proc. Fifth Berkeley Symposium 1 (1967); H. White, "Maximum likelihood
// estimation of misspecified models", Econometrica 50 (1982)). Scores are centred by the windows'
// joint optimum, because the prior or a bound may hold the estimate away from it:
//   ĝ_w = g_w − I_w (I + P)⁻¹ Σ g,   J = κ Σ ĝ_w ĝ_wᵀ,   I = Σ I_w,
//   robust covariance C + C (J − I) C,   C = (I + P)⁻¹,
// with P the prior's precision, and κ the factor that makes E[J] = I for a right model in spite of
// the fit: with q = tr(I C), κ = q/(q − Σ tr((I_w C)²)).
//
// Windows are merged by powers of two as long as at least 12 are left. The length is the one with
// the largest eigenvalue r² of J against I (with P added to both): r = 1.1 … 1.7 when all is well,
// the larger, the more parameters and the fewer windows there are.

#include <vector>

#include "core/estimator/posterior/window_scores.h"

namespace polyest::internal {

struct RobustCovariance {
  double disagreement = 0;   // r; 0 if there are fewer than 12 windows with information
  bool significant = false;  // whether r is larger than chance allows in a right model
  // Per parameter: robust standard deviation ÷ that of (I + P)⁻¹, ≥ 0, 1 if no window says anything
  // of it; empty if r is 0.
  Vector ratio;
};

// `precision` is P (n × n), in the coordinates of the scores.
RobustCovariance RobustCovarianceOf(std::vector<WindowScore> windows, const Matrix& precision);

}  // namespace polyest::internal
