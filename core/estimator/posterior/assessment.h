#pragma once

// Derives an estimate from the sums of an expansion: the minimum of the cost, the curvature, the
// posterior, identifiability and warnings. The computing time does not depend on the number of
// samples.

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "core/bayes/element.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/expansion/replay_allowance.h"
#include "core/estimator/posterior/diagnosis.h"
#include "core/estimator/posterior/filtered_quantities.h"
#include "core/estimator/posterior/mixture_share.h"
#include "core/estimator/posterior/posterior_draws.h"
#include "core/estimator/record/record_summary.h"
#include "polyest/estimate.h"
#include "polyest/stop.h"

namespace polyest::internal {

struct AssessmentRequest {
  const ResolvedProblem* problem = nullptr;
  const RegionalExpansion* expansion = nullptr;
  const RecordSummary* record = nullptr;
  const Matrix* guesses = nullptr;  // particles, germ coordinates (may be empty)
  int reexpansions = 0;
  int64_t propagated_rows = 0;  // trajectories × rows
  PosteriorEffort effort;
  std::optional<double> regularization;  // α² if it has been chosen already
  // For a component of a mixture: whether its share is asked for, and its weight at the last
  // weighing.
  bool weigh = false;
  std::optional<double> power;  // of the likelihood, if it is common to several
  double last_weight = 1;
  // The elements of the other components, if beyond the bounds of its own there is either one of
  // them or a part of the prior that was dropped for its weight; not set if it is not looked there.
  std::optional<std::vector<const Element*>> others;
  Postponed postponed;  // what the limit on rows that are propagated again has put off
};

struct Assessed {
  Estimate estimate;
  PosteriorDraws posterior;  // the draws that the estimate summarizes
  Findings findings;         // the basis of the diagnostics; refers to the request's objects
  MixtureShare share;        // for a component of a mixture
  FilteredDraws filtered;    // at the draws; empty without filters
  std::optional<double> log_evidence;  // if asked for and there is one (model_evidence.h)
};

// Assesses an expansion. Returns an error only on a stop request.
absl::StatusOr<Assessed> Assess(const AssessmentRequest& request, const Stop& stop);

}  // namespace polyest::internal
