#pragma once

// When the elimination of ended runs holds, and how they are eliminated anew.
//
// Each run is eliminated at its end, about the region of the shared germs that the ended runs have
// (run_elimination.h). It is valid near there only. When the posterior has contracted to less than
// 0.7 standard deviations in any direction, or has moved by more than one of them, or the noise's
// scale has changed by a quarter, or its correlation, all ended runs are eliminated again about the
// present posterior. As standard deviations fall with 1/√R, this happens about whenever the number
// R of runs has doubled, and all eliminations together take about 1 + ½ + ¼ + … = 2 times as long
// as one of each run.

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>

#include "core/estimator/expansion/germ_summary.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/expansion/run_elimination.h"
#include "core/estimator/problem/ended_runs.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns the part of a posterior that the runs share.
GermSummary SharedPart(const ResolvedProblem& problem, const GermSummary& posterior);

// Whether what is known of the ended runs holds about this posterior of the shared germs.
bool HoldsAbout(const EndedRuns& ended, const GermSummary& shared);
// Whether it holds for this noise.
bool HoldsWith(const EndedRuns& ended, const LearnedNoise& noise);

// Returns the Gaussian at the minimum of the cost if the posterior is one, by its gradient and
// curvature there.
std::optional<GermSummary> GaussianPosterior(const ResolvedProblem& problem,
                                             const RegionalExpansion& expansion, const Stop& stop);

// Adds the problem's last run, up to the first `rows` rows of the record, to the ended ones.
// Returns the trajectories × rows that it took, or an error as EliminateRun does.
absl::StatusOr<int64_t> EliminateLast(const EliminationRequest& request,
                                      const GermSummary& posterior, int64_t rows, const Stop& stop,
                                      EndedRuns& ended);
// Eliminates all runs in the first `rows` rows about the particles (W × n, germ coordinates) of the
// posterior.
absl::StatusOr<int64_t> EliminateAll(const EliminationRequest& request, const Matrix& particles,
                                     int64_t rows, const Stop& stop, EndedRuns& ended);

}  // namespace polyest::internal
