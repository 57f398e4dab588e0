#include "core/estimator/record/settled_rows.h"

#include <algorithm>

#include "core/common/check.h"

namespace polyest::internal {

void KnotRows::Add(int64_t row) {
  std::shift_right(last.begin(), last.end(), 1);
  last.front() = row;
  ++count;
}

int64_t SettledRows(const ResolvedProblem& problem, const std::vector<KnotRows>& knots,
                    int64_t run_begin, int64_t rows) {
  int64_t settled = rows;
  for (size_t i = 0; i < knots.size(); ++i) {
    const auto needed = static_cast<size_t>(problem.knots_needed()[i]);
    POLYEST_CHECK(needed <= KnotRows::kMaxNeeded);
    // A held input needs a knot to begin with, another one so many at or after a row.
    if (knots[i].count < std::max<int64_t>(1, static_cast<int64_t>(needed))) return run_begin;
    if (needed > 0) settled = std::min(settled, knots[i].last[needed - 1] + 1);
  }
  return settled;
}

}  // namespace polyest::internal
