#include "core/estimator/posterior/reexpansion_schedule.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

constexpr double kWindowGrowth = 1.3;
// After a re-expansion that did not help, further rows are taken with their discount before the
// next attempt: the record since the windows' beginning, divided by this number.
constexpr int64_t kAttemptsPerRecord = 8;
// The region's edges, and weights of outliers, are looked at again after the record since the
// windows' beginning, divided by this number.
constexpr int64_t kLooksPerRecord = 20;
// Where the posterior has not contracted enough, that is looked at again after the record divided
// by this number.
constexpr int64_t kLooksAhead = 10;

}  // namespace

int64_t NextWindow(int64_t rows, int64_t from) {
  const auto window = static_cast<double>(rows - from);
  return std::max(rows + 2, from + static_cast<int64_t>(std::ceil(kWindowGrowth * window)));
}

int64_t ReexpansionSchedule::WeightsServeUntil(int64_t rows) const {
  return rows + std::max<int64_t>(2, (rows - state_.windows_from) / kLooksPerRecord);
}

void ReexpansionSchedule::EndWindow(int64_t rows, int64_t latest_end) {
  state_.window_end = std::min(NextWindow(rows, state_.windows_from), latest_end);
  PutOffEdges(rows);
}

void ReexpansionSchedule::PutOffEdges(int64_t rows) {
  state_.edges_row = rows + 1 + (rows - state_.windows_from) / kLooksPerRecord;
}

void ReexpansionSchedule::PutOffLookAhead(int64_t rows) {
  state_.ahead_row = rows + rows / kLooksAhead;
}

void ReexpansionSchedule::EndRow(int64_t rows) {
  state_.ahead_row = std::max(state_.ahead_row, rows + 1);
}

bool ReexpansionSchedule::MayReexpandBefore(int64_t rows) {
  if (state_.attempted_row != rows) state_.attempts_at_row = 0;
  state_.attempted_row = rows;
  return state_.attempts_at_row < kMaxAttemptsAtRow;
}

void ReexpansionSchedule::TolerateResiduals(int64_t rows) {
  state_.patient_until = rows + 1 + (rows - state_.windows_from) / kAttemptsPerRecord;
}

void ReexpansionSchedule::CountAnewFrom(int64_t rows) {
  state_.windows_from = state_.patient_until = rows;
  state_.window_end = rows + 2;
}

ReexpansionSchedule ReexpansionSchedule::OfPart(int64_t rows) const {
  ReexpansionSchedule part;
  part.state_.window_end = rows;
  part.state_.windows_from = state_.windows_from;
  return part;
}

}  // namespace polyest::internal
