#include "core/estimator/record/rows_ahead.h"

#include <algorithm>

#include "core/common/status.h"

namespace polyest::internal {

absl::Status ReadWithRowsAhead(const SampleStore& store, int64_t first, int64_t count, int ahead,
                               RowBlock& block) {
  const int64_t more = std::min<int64_t>(ahead, store.rows() - first - count);
  POLYEST_RETURN_IF_ERROR(store.Read(first, count + more, block));
  block.ahead = static_cast<int>(more);
  return absl::OkStatus();
}

}  // namespace polyest::internal
