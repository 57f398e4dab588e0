#include "server/sessions/estimate_history.h"

#include <utility>

#include "proto/wire/convert/estimate.h"

namespace polyest::internal {

EstimateHistory::EstimateHistory(const std::vector<JournalHistoryPoint>& kept) {
  for (const JournalHistoryPoint& one : kept) {
    Point point;
    point.ordinal = one.ordinal;
    if (point.point.ParseFromString(one.point)) points_.push_back(std::move(point));
  }
  Thin();
}

std::optional<JournalHistoryPoint> EstimateHistory::Add(const v1::Estimate& estimate) {
  Point added{0, ToHistoryPoint(estimate)};
  if (!points_.empty()) {
    const Point& newest = points_.back();
    if (estimate.sequence() <= newest.point.sequence()) return std::nullopt;
    added.ordinal = newest.ordinal + 1;
    if (newest.ordinal % stride_ != 0) points_.pop_back();
  }
  points_.push_back(std::move(added));
  Thin();
  const Point& newest = points_.back();
  if (newest.ordinal % stride_ != 0) return std::nullopt;
  return JournalHistoryPoint{newest.ordinal, newest.point.sequence(),
                             newest.point.SerializeAsString()};
}

// Doubles the stride until all ordinals up to the newest have room.
void EstimateHistory::Thin() {
  if (points_.empty()) return;
  const int64_t newest = points_.back().ordinal;
  const int64_t before = stride_;
  while (newest / stride_ >= kMaxPoints) stride_ *= 2;
  if (stride_ == before) return;
  std::erase_if(points_, [&](const Point& point) {
    return point.ordinal % stride_ != 0 && point.ordinal != newest;
  });
}

v1::EstimateHistory EstimateHistory::Points() const {
  v1::EstimateHistory history;
  for (const Point& point : points_) *history.add_points() = point.point;
  return history;
}

}  // namespace polyest::internal
