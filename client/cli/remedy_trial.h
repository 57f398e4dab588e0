#pragma once

// Tries on a record which remedies its residuals ask for.

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "client/cli/backend.h"
#include "client/cli/model_comparison.h"
#include "client/cli/remedy.h"

namespace polyest::internal {

struct TriedRemedy {
  Remedy remedy;
  v1::Problem problem;  // with the remedy
  Assessment assessment;
  double gain = 0;      // of log evidence over the problem as it is
  bool scored = false;  // whether the assessment has a score
};

struct RefusedRemedy {
  Remedy remedy;
  absl::Status refusal;
};

struct RemedyTrial {
  Assessment untreated;            // the problem as it is
  std::vector<TriedRemedy> tried;  // the one with the highest evidence first
  std::vector<Remedy> left_out;    // beyond the number that is tried
  std::vector<RefusedRemedy> refused;
  absl::Status refusal;  // of the problem as it is, which is then not weighed; else OK
  absl::Status ended;    // what ended the trial early, after the remedies tried; else OK
};

// Returns the codes among the diagnostics that say that the data contradict a perfect model with
// white noise, each once.
std::vector<v1::Diagnostic::Code> Contradictions(
    const google::protobuf::RepeatedPtrField<v1::Diagnostic>& diagnostics);

// Returns whether the estimate of a problem is contradicted in a way that remedies may explain: by
// one of these diagnostics, unless the residuals of all outputs are too small for the noise.
bool CallsForRemedies(const v1::Problem& problem, const v1::Estimate& estimate);

// Tries the remedies, at most eight that are not refused. One with a size has the evidence of the
// best size tried; of the best two that gain a decisive evidence, the size is then estimated, and
// they are scored on held-out rows as the problem is. Without any evidence of the problem, nothing
// is tried. An error after some remedies have been tried ends the trial with these.
absl::StatusOr<RemedyTrial> TryRemedies(const v1::Experiment& experiment,
                                        const v1::Estimate& estimate, Backend& backend);

}  // namespace polyest::internal
