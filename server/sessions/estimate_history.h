#pragma once

// The history of a session's estimates, thinned so that it stays small: each estimate has an
// ordinal, and those whose ordinal is a multiple of the stride are kept. The stride doubles
// whenever there are kMaxPoints of them.

#include <cstdint>
#include <optional>
#include <vector>

#include "polyest/v1/estimate.pb.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

// For one thread at a time.
class EstimateHistory {
 public:
  static constexpr int64_t kMaxPoints = 512;

  EstimateHistory() = default;
  // Continues a history from what the journal keeps of it. Points that cannot be read are left out.
  explicit EstimateHistory(const std::vector<JournalHistoryPoint>& kept);

  // Adds an estimate, unless it takes no later batch into account than the last one. Returns what
  // the journal is to save with the stride, if anything.
  std::optional<JournalHistoryPoint> Add(const v1::Estimate& estimate);
  int64_t stride() const { return stride_; }

  // Returns the points kept, and the newest one.
  v1::EstimateHistory Points() const;

 private:
  struct Point {
    int64_t ordinal = 0;
    v1::EstimateHistory::Point point;
  };

  void Thin();

  int64_t stride_ = 1;
  std::vector<Point> points_;  // those kept, and the newest one
};

}  // namespace polyest::internal
