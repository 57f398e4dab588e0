#include "server/sessions/batch_replay.h"

#include <utility>

#include "core/common/status.h"
#include "core/estimator/record/sample_checks.h"
#include "proto/wire/convert/measurements.h"

namespace polyest::internal {

BatchReplay::BatchReplay(const ResolvedProblem& problem, double reorder_window_s,
                         const RunCuts& cuts, const RowReorder::Resumption& from)
    : problem_(problem), cuts_(cuts) {
  if (reorder_window_s > 0) {
    reorder_.emplace(SampleChecks(problem).names(), reorder_window_s, from);
  }
}

absl::StatusOr<Samples> BatchReplay::Next(const v1::Measurements& batch) {
  POLYEST_ASSIGN_OR_RETURN(Samples samples, ToSamples(batch, *problem_.problem().model));
  if (reorder_) {
    auto step = reorder_->Next(samples);
    if (!step.ok()) return absl::DataLossError(step.status().message());
    samples = std::move(step->released);
    reorder_->Accept(*std::move(step));
  }
  return cuts_.Keep(std::move(samples));
}

}  // namespace polyest::internal
