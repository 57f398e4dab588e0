#include "core/estimator/memory_store.h"

#include "core/common/check.h"

namespace polyest {
namespace {

void CopyRows(const std::vector<double>& from, int64_t total_rows, int64_t first, int64_t count,
              std::vector<double>& to) {
  const int64_t width = total_rows == 0 ? 0 : static_cast<int64_t>(from.size()) / total_rows;
  to.assign(from.begin() + first * width, from.begin() + (first + count) * width);
}

}  // namespace

absl::Status MemoryStore::Append(const SampleRow& row, const std::vector<double>& values,
                                 const std::vector<double>& noise) {
  rows_.push_back(row);
  values_.insert(values_.end(), values.begin(), values.end());
  noise_.insert(noise_.end(), noise.begin(), noise.end());
  return absl::OkStatus();
}

absl::Status MemoryStore::Read(int64_t first, int64_t count, std::vector<SampleRow>& rows,
                               std::vector<double>& values, std::vector<double>& noise) const {
  POLYEST_CHECK(first >= 0 && count >= 0 && first + count <= MemoryStore::rows());
  rows.assign(rows_.begin() + first, rows_.begin() + first + count);
  CopyRows(values_, MemoryStore::rows(), first, count, values);
  CopyRows(noise_, MemoryStore::rows(), first, count, noise);
  return absl::OkStatus();
}

}  // namespace polyest
