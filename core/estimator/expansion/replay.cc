#include "core/estimator/expansion/replay.h"

#include <algorithm>
#include <utility>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr int64_t kReplayRows = 256;

}  // namespace

absl::StatusOr<std::unique_ptr<RegionalExpansion>> Replay(const ResolvedProblem& problem,
                                                          ExpansionDesign design,
                                                          LearnedNoise noise,
                                                          const SampleStore& store, int64_t rows,
                                                          int threads, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(
      std::unique_ptr<RegionalExpansion> expansion,
      RegionalExpansion::Make(problem, &store, std::move(design), std::move(noise), threads, stop));
  POLYEST_RETURN_IF_ERROR(TakeRows(store, rows, stop, *expansion));
  return expansion;
}

absl::Status TakeRows(const SampleStore& store, int64_t end, const Stop& stop,
                      RegionalExpansion& expansion) {
  RowBlock block;
  for (int64_t first = expansion.next_row(); first < end; first += block.count()) {
    const int64_t count = std::min(kReplayRows, end - first);
    POLYEST_RETURN_IF_ERROR(store.Read(first, count, block));
    const int kept = expansion.RowsToKeptState(block);
    if (kept < count) POLYEST_RETURN_IF_ERROR(store.Read(first, kept, block));
    POLYEST_RETURN_IF_ERROR(expansion.Propagate(block, stop));
    if (expansion.fitted_rows() < block.count()) return expansion.shortage();
    for (int row = 0; row < block.count(); ++row) expansion.Absorb(row);
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
