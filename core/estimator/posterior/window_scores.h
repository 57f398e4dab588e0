#pragma once

// The scores of the record's windows at an estimate. For window w with the mismatch J_w, in
// coordinates s in which each parameter's normal score has the prior standard deviation 1,
//   g_w = ∂J_w/∂s,   I_w = Σ (∂y_k/∂s)(∂y_k/∂s)ᵀ/R_k   (Gauss–Newton),
// so that −I_w⁻¹ g_w is the step from the estimate to what the window's samples alone prefer. If
// model and noise are right, g_w has the covariance I_w, apart from what the fit itself takes.
// A channel with a learned scale counts with R_k scaled to its own mean square.

#include <vector>

#include "core/bayes/window_sums.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

struct WindowScore {
  WindowSpan span;
  Vector score;        // g_w, n
  Matrix information;  // I_w, n × n
};

// Returns the scores of the expansion's windows in order, at `eta` (local coordinates). A last
// window shorter than half of the others is merged into the one before.
std::vector<WindowScore> ScoresByWindow(const RegionalExpansion& expansion, const Prior& prior,
                                        const Vector& eta);

// Returns the scores of windows of the runs that have ended (there must be some; `problem` has
// them), at `xi`, with what their own parameters follow and take up integrated out:
//   g_w = −∂ log L_w/∂s,   I_w = Σ (∂y_k/∂s)(∂y_k/∂s)ᵀ/R_k along the runs' paths + ∂²E_w/∂s²
// (problem/ended_runs.h). There are none if the runs share a population.
std::vector<WindowScore> ScoresByEndedRuns(const ResolvedProblem& problem, const Vector& xi);

// Returns the scores of windows twice as long: pairs of neighbours are merged. A window left over
// at the end joins the last pair if it has fewer than half of its rows.
std::vector<WindowScore> MergePairs(const std::vector<WindowScore>& windows);

// Returns the sum of all windows' scores, and their information.
WindowScore SumOf(const std::vector<WindowScore>& windows);

// Returns the precision (n × n) of the prior in the coordinates s, that of a Gaussian with the
// prior's covariance: the identity if no parameters are correlated.
Matrix PriorPrecision(const Prior& prior);

}  // namespace polyest::internal
