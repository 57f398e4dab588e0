#include "server/sessions/journal_store.h"

#include <algorithm>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/estimator/record/row_block.h"

namespace polyest::internal {

JournalStore::JournalStore(const ResolvedProblem& problem, double reorder_window_s, RunCuts cuts)
    : problem_(problem),
      reorder_window_s_(reorder_window_s),
      cuts_(std::move(cuts)),
      position_(SampleChecks(problem).position()) {
  open_.before = position_;
}

void JournalStore::ReadFrom(const SessionJournal& journal, int64_t number) {
  journal_ = &journal;
  number_ = number;
}

absl::Status JournalStore::Append(const RowBlock& batch) {
  AppendRows(batch, 0, static_cast<int64_t>(batch.rows.size()), tail_);
  position_ = After(position_, batch);
  open_.last_batch = ++batches_;
  if (static_cast<int64_t>(tail_.rows.size()) < kSegmentRows) return absl::OkStatus();
  open_.rows = std::make_shared<const RowBlock>(std::exchange(tail_, {}));
  segments_.push_back(std::move(open_));
  open_ = {.before = position_,
           .first_batch = batches_ + 1,
           .last_batch = batches_,
           .read_from = held_from_ > 0 ? held_from_ : batches_ + 1,
           .rows = nullptr};
  return absl::OkStatus();
}

void JournalStore::PassOver() { open_.last_batch = ++batches_; }

void JournalStore::Release(int64_t sequence) {
  POLYEST_CHECK(journal_ != nullptr);
  for (; released_ < segments_.size(); ++released_) {
    Segment& segment = segments_[released_];
    if (segment.last_batch > sequence) return;
    Remember(released_, std::exchange(segment.rows, nullptr));
  }
}

absl::Status JournalStore::Read(int64_t first, int64_t count, RowBlock& block) const {
  POLYEST_CHECK(first >= 0 && count > 0 && first + count <= rows());
  ClearRows(block);
  block.run_ended = position_.run_ended && first + count == rows();
  for (const int64_t end = first + count; first < end;) {
    const size_t number = SegmentWith(first);
    const bool complete = number < segments_.size();
    const Segment& segment = complete ? segments_[number] : open_;
    Rows rows;
    if (complete) {
      POLYEST_ASSIGN_OR_RETURN(rows, RowsOf(number));
    }
    const RowBlock& source = complete ? *rows : tail_;
    const int64_t skipped = first - segment.before.rows;
    const int64_t some = std::min(end - first, static_cast<int64_t>(source.rows.size()) - skipped);
    AppendRows(source, skipped, some, block);
    first += some;
  }
  return absl::OkStatus();
}

int64_t JournalStore::rows_in_memory() const {
  auto rows = static_cast<int64_t>(tail_.rows.size());
  for (const Segment& segment : segments_) {
    if (segment.rows != nullptr) rows += static_cast<int64_t>(segment.rows->rows.size());
  }
  for (const Used& used : used_) {
    if (used.rows != nullptr) rows += static_cast<int64_t>(used.rows->rows.size());
  }
  return rows;
}

size_t JournalStore::SegmentWith(int64_t row) const {
  if (row >= open_.before.rows) return segments_.size();
  const auto after =
      std::upper_bound(segments_.begin(), segments_.end(), row,
                       [](int64_t r, const Segment& segment) { return r < segment.before.rows; });
  return static_cast<size_t>(after - segments_.begin()) - 1;
}

absl::StatusOr<JournalStore::Rows> JournalStore::RowsOf(size_t segment) const {
  if (segments_[segment].rows != nullptr) return segments_[segment].rows;
  for (const Used& used : used_) {
    if (used.rows != nullptr && used.segment == segment) return used.rows;
  }
  const Segment& next = segment + 1 < segments_.size() ? segments_[segment + 1] : open_;
  POLYEST_ASSIGN_OR_RETURN(
      Rows rows,
      ReadSegment(segments_[segment], next.before.rows - segments_[segment].before.rows));
  Remember(segment, rows);
  return rows;
}

absl::StatusOr<JournalStore::Rows> JournalStore::ReadSegment(const Segment& segment,
                                                             int64_t rows) const {
  RowBlock read;
  SampleChecks checks(problem_, segment.before);
  RowReorder::Resumption from{.first_batch = segment.read_from, .released = std::nullopt};
  const RecordPosition& before = segment.before;
  if (before.rows > 0) from.released = SampleRow{before.run, before.time_s};
  BatchReplay replay(problem_, reorder_window_s_, cuts_, from);
  POLYEST_RETURN_IF_ERROR(journal_->ReadBatchesUpTo(
      number_, segment.read_from - 1, segment.last_batch,
      [&](const JournalBatch& batch) { return ReadBatch(batch, replay, checks, read); }));
  if (static_cast<int64_t>(read.rows.size()) != rows) {
    return absl::DataLossError("rows of the session are missing in the journal");
  }
  return std::make_shared<const RowBlock>(std::move(read));
}

absl::Status JournalStore::ReadBatch(const JournalBatch& batch, BatchReplay& replay,
                                     SampleChecks& checks, RowBlock& read) {
  POLYEST_ASSIGN_OR_RETURN(const Samples samples, replay.Next(batch.measurements));
  if (RowReorder::IsNothing(samples)) return absl::OkStatus();
  const auto checked = checks.Check(samples);
  if (!checked.ok()) return absl::DataLossError(checked.status().message());
  AppendRows(*checked, 0, static_cast<int64_t>(checked->rows.size()), read);
  checks.Accept(*checked);
  return absl::OkStatus();
}

void JournalStore::Remember(size_t segment, Rows rows) const {
  std::rotate(used_.begin(), used_.end() - 1, used_.end());
  used_.front() = {segment, std::move(rows)};
}

}  // namespace polyest::internal
