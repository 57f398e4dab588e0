#include "server/sessions/estimate_history.h"

#include <utility>

#include "proto/wire/convert/estimate.h"

namespace polyest::internal {
namespace {

void AddPoint(const JournalHistoryPoint& point, v1::EstimateHistory& history) {
  v1::EstimateHistory::Point parsed;
  if (parsed.ParseFromString(point.point)) *history.add_points() = std::move(parsed);
}

}  // namespace

EstimateHistory::EstimateHistory(const std::vector<JournalHistoryPoint>& kept) {
  if (!kept.empty()) SetNewest(kept.back());
}

std::optional<JournalHistoryPoint> EstimateHistory::Add(const v1::Estimate& estimate) {
  if (newest_ && estimate.sequence() <= newest_->sequence) return std::nullopt;
  SetNewest({newest_ ? newest_->ordinal + 1 : 0, estimate.sequence(),
             ToHistoryPoint(estimate).SerializeAsString()});
  if (newest_->ordinal % stride_ != 0) return std::nullopt;
  return newest_;
}

void EstimateHistory::SetNewest(JournalHistoryPoint point) {
  while (point.ordinal / stride_ >= kMaxPoints) stride_ *= 2;
  newest_ = std::move(point);
}

v1::EstimateHistory EstimateHistory::Points(const std::vector<JournalHistoryPoint>& kept) const {
  v1::EstimateHistory history;
  for (const JournalHistoryPoint& point : kept) AddPoint(point, history);
  const int64_t last = kept.empty() ? -1 : kept.back().ordinal;
  if (newest_ && newest_->ordinal > last) AddPoint(*newest_, history);
  return history;
}

}  // namespace polyest::internal
