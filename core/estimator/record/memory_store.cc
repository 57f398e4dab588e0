#include "core/estimator/record/memory_store.h"

#include "core/common/check.h"
#include "core/estimator/record/row_block.h"

namespace polyest::internal {

absl::Status MemoryStore::Append(const RowBlock& block) {
  AppendRows(block, 0, static_cast<int64_t>(block.rows.size()), record_);
  record_.run_ended = block.run_ended;
  return absl::OkStatus();
}

absl::Status MemoryStore::Read(int64_t first, int64_t count, RowBlock& block) const {
  POLYEST_CHECK(count > 0);
  ClearRows(block);
  AppendRows(record_, first, count, block);
  block.run_ended = record_.run_ended && first + count == rows();
  return absl::OkStatus();
}

}  // namespace polyest::internal
