#pragma once

// Warnings to the user about an estimate, each in one sentence.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/expansion/replay_allowance.h"
#include "core/estimator/posterior/prior_conflict.h"
#include "core/estimator/posterior/window_assessment.h"
#include "core/estimator/record/record_summary.h"
#include "polyest/estimate.h"
#include "polyest/stop.h"

namespace polyest::internal {

// An expansion is called inaccurate when a posterior mean may be wrong by this many of its standard
// deviations.
inline constexpr double kInaccurateShift = 0.25;
// Power of the likelihood below which the posterior shows where the expansion was made and not what
// the data say.
inline constexpr double kMinUsed = 0.01;

struct Findings {
  // Whether more of the shift is due to the integration than to the expansion.
  bool IntegrationPrevails() const {
    return 2 * integration_shift * integration_shift > shift * shift;
  }
  // Whether more of it is due to how a population is told of ended runs.
  bool PopulationPrevails() const {
    return 2 * population_shift * population_shift > shift * shift;
  }
  // Returns the factor of the uncertainty for the expansion's own error.
  double WideningForShift() const;
  // Whether sums were taken over with an error for which the record would have been propagated
  // again without a limit.
  bool CarriesError() const;
  // Whether the expansion follows the model so far that the posterior tells of the data.
  bool UsesData() const { return power >= kMinUsed; }
  // Whether parameter i must not be called identified.
  bool IsDoubtful(int i) const {
    return postponed.any() || power < 1 || !not_mixed.empty() ||
           windows.doubtful[static_cast<size_t>(i)];
  }
  // Whether the standard deviation of parameter i is the draws', which the curvature contradicts.
  bool GoesByDraws(int i) const {
    return drawn_to_curvature.size() > i && drawn_to_curvature[i] > 0;
  }
  const std::string& NameOf(int parameter) const;

  const ResolvedProblem* problem = nullptr;
  const RegionalExpansion* expansion = nullptr;
  const RecordSummary* record = nullptr;
  std::vector<double> degrees;  // expected χ² by channel, its degrees of freedom
  Vector map_xi;                // the minimum, germ coordinates
  bool converged = true;
  std::string minimizer_reason;
  std::string not_mixed;             // why the posterior's Markov chains cannot be trusted, if so
  std::vector<Vector> other_minima;  // θ of other minima with comparable cost
  double left_out = 0;               // share of mixture components dropped for lack of room
  double shift = 0;                  // bound on the error of a mean, in standard deviations
  double integration_shift = 0;      // the part of it that the integration causes
  double population_shift = 0;       // the part of it that ended runs of a population cause
  double carried_shift = 0;          // the part of it that sums taken over cause
  // Posterior probability of the components whose shift exceeds kInaccurateShift, of several.
  double inaccurate_weight = 1;
  Postponed postponed;  // what the limit on rows propagated again has put off
  // Power of the likelihood that the posterior was taken from ÷ that which the residuals allow.
  double power = 1;
  bool leans = false;        // whether the posterior goes on beyond the region of the expansion
  WindowAssessment windows;  // what the windows of the record say
  PriorConflict conflict;    // how far what the data say is from the prior
  // By parameter, where the draws' standard deviation replaces the curvature's: draws' ÷
  // curvature's, else 0; may be empty.
  Vector drawn_to_curvature;
  // Why the requested rule did not choose α²; empty if it did or if no rule was requested.
  std::string regularization_not_determined;
};

// Returns the diagnostics. Reads the parts of `estimate` that are filled in already; the caller
// stores the result in its diagnostics. Some need runs of the model: fails on a stop request.
absl::StatusOr<std::vector<Diagnostic>> Diagnose(const Findings& findings, const Estimate& estimate,
                                                 const Stop& stop);

}  // namespace polyest::internal
