#include "core/estimator/record/settled_rows.h"

#include <algorithm>

#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

absl::StatusOr<double> TimeOf(const SampleStore& store, int64_t row) {
  RowBlock block;
  POLYEST_RETURN_IF_ERROR(store.Read(row, 1, block));
  return block.rows.front().time_s;
}

// Returns the number of rows of one run, which begins with row `first`, that lie at least `lead_s`
// before the last of its first rows up to `end`.
absl::StatusOr<int64_t> RowsAhead(const SampleStore& store, int64_t first, int64_t end,
                                  double lead_s) {
  if (first == end) return end;
  POLYEST_ASSIGN_OR_RETURN(const double last_s, TimeOf(store, end - 1));
  while (first < end) {
    const int64_t middle = first + (end - first) / 2;
    POLYEST_ASSIGN_OR_RETURN(const double time_s, TimeOf(store, middle));
    if (time_s + lead_s <= last_s) {
      first = middle + 1;
    } else {
      end = middle;
    }
  }
  return end;
}

}  // namespace

void KnotRows::Add(int64_t row) {
  std::shift_right(last.begin(), last.end(), 1);
  last.front() = row;
  ++count;
}

absl::StatusOr<int64_t> SettledRows(const ResolvedProblem& problem,
                                    const std::vector<KnotRows>& knots, int64_t run_begin,
                                    int64_t rows, const SampleStore& store) {
  int64_t settled = rows;
  for (size_t i = 0; i < knots.size(); ++i) {
    const auto needed = static_cast<size_t>(problem.knots_needed()[i]);
    POLYEST_CHECK(needed <= KnotRows::kMaxNeeded);
    // A held input needs a knot to begin with, another one so many at or after a row.
    if (knots[i].count < std::max<int64_t>(1, static_cast<int64_t>(needed))) return run_begin;
    if (needed > 0) settled = std::min(settled, knots[i].last[needed - 1] + 1);
  }
  if (problem.lead_s() == 0) return settled;
  return RowsAhead(store, run_begin, settled, problem.lead_s());
}

}  // namespace polyest::internal
