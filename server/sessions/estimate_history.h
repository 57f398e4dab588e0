#pragma once

// The history of a session's estimates, thinned so that it stays small: each estimate has an
// ordinal, and those whose ordinal is a multiple of the stride are kept, in the journal. The stride
// doubles whenever there are kMaxPoints of them.

#include <cstdint>
#include <optional>
#include <vector>

#include "polyest/v1/estimate.pb.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

// For one thread at a time. Holds the newest estimate and no other.
class EstimateHistory {
 public:
  static constexpr int64_t kMaxPoints = 512;

  EstimateHistory() = default;
  // Continues a history from what the journal keeps of it.
  explicit EstimateHistory(const std::vector<JournalHistoryPoint>& kept);

  // Adds an estimate, unless it takes no later batch into account than the last one. Returns what
  // the journal is to save with the stride, if anything.
  std::optional<JournalHistoryPoint> Add(const v1::Estimate& estimate);
  int64_t stride() const { return stride_; }

  // Returns the points that the journal keeps, and the newest one. Points that cannot be read are
  // left out.
  v1::EstimateHistory Points(const std::vector<JournalHistoryPoint>& kept) const;

 private:
  // Lets `point` be the newest one and doubles the stride until all ordinals up to it have room.
  void SetNewest(JournalHistoryPoint point);

  int64_t stride_ = 1;
  std::optional<JournalHistoryPoint> newest_;
};

}  // namespace polyest::internal
