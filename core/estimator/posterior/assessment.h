#pragma once

// From the sums of an expansion to an estimate: minimum of the cost, curvature, posterior,
// identifiability and what the engineer should be warned of. Its cost does not depend on the
// number of samples.

#include <absl/status/statusor.h>

#include <optional>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/posterior/diagnosis.h"
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
  const Matrix* guesses = nullptr;  // particles, germ coordinates (may have no rows)
  int reexpansions = 0;
  int64_t propagated_rows = 0;  // trajectories × rows
  PosteriorEffort effort;
  std::optional<double> regularization;  // α² when it has been chosen already
  // Of a mixture's component: what is its own, and its weight when that was last looked at.
  const MixturePartition* partition = nullptr;
  size_t component = 0;
  double last_weight = 1;
};

struct Assessed {
  Estimate estimate;
  PosteriorDraws posterior;  // that it sums up
  Findings findings;         // that its diagnostics are of; refers to what the request does
  MixtureShare share;        // of a mixture's component
};

// mean, posterior_std_dev and limits of parameter i.
void DescribeMarginal(const PosteriorDraws& posterior, const Prior& prior, int i,
                      ParameterEstimate& parameter);

// Only a stop request makes it not OK.
absl::StatusOr<Assessed> Assess(const AssessmentRequest& request, const Stop& stop);

}  // namespace polyest::internal
