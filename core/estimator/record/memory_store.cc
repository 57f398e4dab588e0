#include "core/estimator/record/memory_store.h"

#include "core/common/check.h"

namespace polyest::internal {
namespace {

template <class T>
void AppendTo(std::vector<T>& all, const std::vector<T>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

// The part of `all` that belongs to rows [first, first + count) of `rows`.
template <class T>
void CopyRows(const std::vector<T>& all, int64_t rows, int64_t first, int64_t count,
              std::vector<T>& part) {
  const int64_t width = static_cast<int64_t>(all.size()) / rows;
  part.assign(all.begin() + first * width, all.begin() + (first + count) * width);
}

}  // namespace

absl::Status MemoryStore::Append(const RowBlock& block) {
  AppendTo(record_.rows, block.rows);
  AppendTo(record_.values, block.values);
  AppendTo(record_.noise, block.noise);
  record_.run_ended = block.run_ended;
  return absl::OkStatus();
}

absl::Status MemoryStore::Read(int64_t first, int64_t count, RowBlock& block) const {
  const int64_t all = rows();
  POLYEST_CHECK(first >= 0 && count > 0 && first + count <= all);
  CopyRows(record_.rows, all, first, count, block.rows);
  CopyRows(record_.values, all, first, count, block.values);
  CopyRows(record_.noise, all, first, count, block.noise);
  block.ahead = 0;
  block.run_ended = record_.run_ended && first + count == all;
  return absl::OkStatus();
}

}  // namespace polyest::internal
