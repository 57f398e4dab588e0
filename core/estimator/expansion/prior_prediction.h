#pragma once

// What the prior predicts for the first samples of a record.

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/record/record_summary.h"

namespace polyest::internal {

// Adds what the prior predicts for the samples of row `row` of the block that the expansion has
// propagated last; nothing if the expansion is not over the whole prior.
void AddPredictionsOf(const RegionalExpansion& expansion, int row, RecordSummary& record);

// Adds the predictions for the first rows of `record`, at most 16, which an estimator would add as
// it takes them. Adds none if the record starts late or the model cannot be run there within a
// second of wall-clock time: a check of data must answer soon, however slow the model is, and how
// slow it is nobody knows before it has run. For a model that takes about a second, the check's
// warnings may therefore differ from one time to the next. No estimate depends on them.
void AddPredictionsOfPrior(const ResolvedProblem& problem, RecordSummary& record);

}  // namespace polyest::internal
