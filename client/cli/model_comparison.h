#pragma once

// Judges a problem by its evidence and by how it predicts rows that are held out.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/backend.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// A difference of log evidence that decides between two problems: odds of 20 to 1.
inline constexpr double kDecisiveEvidence = 3;

// What speaks for a problem.
struct Assessment {
  int64_t values = 0;                   // measured, over all channels
  std::optional<double> log_evidence;   // of all samples
  std::set<std::string> unknown_noise;  // outputs whose noise has an unknown size
  int64_t held_out = 0;                 // samples
  double log_score = 0;                 // Σ log p over them
  double covered = 0;                   // of them by 95 % intervals
  // Diagnostics of the estimate from the rows before that make the score doubtful.
  std::vector<v1::Diagnostic::Code> doubts;
  v1::ComputePosteriorResponse posterior;
};

// Computes the posterior and the evidence of a problem. The result has no score yet.
absl::StatusOr<Assessment> Weigh(const v1::Experiment& experiment, Backend& backend);

// Adds the score of the rows held out, by an estimate from those before. INVALID_ARGUMENT if that
// leaves no row to estimate from or none to predict.
absl::Status Score(const v1::Experiment& whole, const HoldOut& hold_out, Backend& backend,
                   Assessment& assessment);

// Returns whether both problems have an evidence and their difference has a meaning: an integral
// over noise of unknown size has no unit in common with a density.
bool HaveComparableEvidence(const Assessment& one, const Assessment& other);

// Returns the fraction of the samples held out that 95 % intervals cover.
double Coverage(const Assessment& assessment);

}  // namespace polyest::internal
