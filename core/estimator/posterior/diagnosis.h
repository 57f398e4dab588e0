#pragma once

// What the engineer should be warned of, each as one sentence.

#include <vector>

#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/record/record_summary.h"
#include "polyest/estimate.h"

namespace polyest::internal {

// An expansion is called inaccurate when a posterior mean may be off by this many of its standard
// deviations.
inline constexpr double kInaccurateShift = 0.25;

struct Findings {
  const ResolvedProblem* problem = nullptr;
  const RegionalExpansion* expansion = nullptr;
  const RecordSummary* record = nullptr;
  Vector map_xi;  // the minimum, germ coordinates
  bool converged = true;
  std::string minimizer_reason;
  std::vector<Vector> other_minima;  // θ of other minima of comparable cost
  double left_out = 0;               // share of a mixture's components there was no room for
  double shift = 0;                  // bound on the error of a mean, in standard deviations
  // Why the rule asked for has not chosen α²; empty where it has, or none was asked for.
  std::string regularization_not_determined;
};

// Reads what `estimate` holds already; the result goes into its diagnostics.
std::vector<Diagnostic> Diagnose(const Findings& findings, const Estimate& estimate);

}  // namespace polyest::internal
