#include "core/estimator/record/row_block.h"

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// Appends the part of `from`, which has values for `rows` rows, that belongs to [first, first +
// count).
template <class T>
void AppendPart(const std::vector<T>& from, int64_t rows, int64_t first, int64_t count,
                std::vector<T>& to) {
  const int64_t width = static_cast<int64_t>(from.size()) / rows;
  to.insert(to.end(), from.begin() + first * width, from.begin() + (first + count) * width);
}

}  // namespace

void AppendRows(const RowBlock& from, int64_t first, int64_t count, RowBlock& to) {
  const auto rows = static_cast<int64_t>(from.rows.size());
  POLYEST_CHECK(first >= 0 && count >= 0 && first + count <= rows);
  if (count == 0) return;
  AppendPart(from.rows, rows, first, count, to.rows);
  AppendPart(from.values, rows, first, count, to.values);
  AppendPart(from.noise, rows, first, count, to.noise);
}

void ClearRows(RowBlock& block) {
  block.rows.clear();
  block.values.clear();
  block.noise.clear();
}

}  // namespace polyest::internal
