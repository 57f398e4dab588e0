#pragma once

// A test of whether the parameters are constant over the record. For one parameter i, the
// alternative lets it change by its own δ_w in each window while all others stay common to the
// record. To second order, twice the fall of the cost is
//   F_i(W) = Σ_w g_wi²/I_w,ii + vᵀ M⁻¹ v,
//   v = p + Σ_w (g_w − I_w,·i g_wi/I_w,ii),   M = P + Σ_w (I_w − I_w,·i I_w,i·/I_w,ii)
// (rows and columns other than i), with the gradient p and the curvature P of the prior. T = F_i(W)
// − F_i(1), with all windows merged into one, is χ² with W − 1 degrees of freedom if the parameter
// is constant and the noise is right. It is the same wherever a quadratic cost is expanded: an
// estimate on a bound of the prior, at which p + Σ_w g_w is not 0, pulls on all windows alike, and
// that is no change. This is the score (Lagrange multiplier) test of constancy with known groups
// (C. R. Rao, Proc. Cambridge Philosophical Society 44 (1948)). It is made for windows of several
// lengths; T is divided by the residuals' own variance relative to the noise, so that a misfit
// alone is not taken for a change.

#include <optional>
#include <vector>

#include "core/estimator/posterior/window_scores.h"

namespace polyest::internal {

// One parameter in one window, the others common to all windows.
struct WindowChange {
  WindowSpan span;
  double change = 0;   // δ_w, in prior standard deviations of the parameter's score
  double std_dev = 0;  // of δ_w
};

struct Inconsistency {
  int parameter = 0;
  // The two windows that differ most, in order, among those that determine the parameter.
  WindowChange first, second;
  double separation = 0;  // their difference in standard deviations
};

// Returns the parameter whose change explains the scores best, if any change is significant (less
// than 10⁻⁴ by chance, over all parameters and lengths). `precision` is P and `prior_gradient` is p
// in the coordinates of the scores, `dispersion` ≥ 1 the variance of the residuals relative to the
// noise, with their correlation taken into account.
std::optional<Inconsistency> FindInconsistency(std::vector<WindowScore> windows,
                                               const Matrix& precision,
                                               const Vector& prior_gradient, double dispersion);

}  // namespace polyest::internal
