#pragma once

// Keeps the record of a session for its estimator without holding all of it in memory: the journal
// keeps the batches anyway, and rows that an expansion needs again are read from there.
//
// The record is divided into segments of whole batches. In memory are the segments that the journal
// does not keep yet, the last one, and the two that were used last; of each other segment only
// where the record stood before it, which is all that its rows need to pass the checks once more
// and to get the same noise. If rows may arrive out of order, batches before those of a segment may
// have rows in it: the segment then knows from which batch on to read.

#include <absl/status/status.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/sample_checks.h"
#include "polyest/samples.h"
#include "server/journal/session_journal.h"
#include "server/sessions/batch_replay.h"
#include "server/sessions/run_cuts.h"

namespace polyest::internal {

// For one thread at a time.
class JournalStore final : public SampleStore {
 public:
  // A segment ends with the batch that brings it to this many rows.
  static constexpr int64_t kSegmentRows = 4096;

  // `problem` must outlive the store. `reorder_window_s` is the session's, as of BatchIntake.
  // `cuts` leave out rows that the journal has.
  explicit JournalStore(const ResolvedProblem& problem, double reorder_window_s = 0,
                        RunCuts cuts = {});

  // Sets where released batches are read again: in `journal`, which must outlive the store, as
  // those of session `number`.
  void ReadFrom(const SessionJournal& journal, int64_t number);
  // Frees the memory of segments that consist of batches up to `sequence`; the journal must keep
  // these. Requires ReadFrom.
  void Release(int64_t sequence);

  int64_t rows() const override { return position_.rows; }
  // Each call is one batch: the first is batch 1, the next one batch 2, and so on.
  absl::Status Append(const RowBlock& batch) override;
  // Goes on to the next batch without appending rows: all of its rows are held back or left out.
  void PassOver();
  // Sets what RowReorder::held_from will be after the next batch, which is then appended or passed
  // over. Not needed if rows come in time order.
  void SetHeldFrom(int64_t batch) { held_from_ = batch; }
  // Fails as SessionJournal::ReadBatches; DATA_LOSS if the journal has other rows than those
  // appended.
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override;

  // The number of rows in memory.
  int64_t rows_in_memory() const;

 private:
  using Rows = std::shared_ptr<const RowBlock>;

  struct Segment {
    RecordPosition before;  // where the record stood before its first row
    int64_t first_batch = 1;
    int64_t last_batch = 0;
    int64_t read_from = 1;  // the earliest batch with rows in it, ≤ first_batch
    Rows rows;              // null: only in the journal
  };
  struct Used {
    size_t segment = 0;
    Rows rows;  // null: none yet
  };

  // Returns the number of the complete segment with this row; that of the open one otherwise.
  size_t SegmentWith(int64_t row) const;
  absl::StatusOr<Rows> RowsOf(size_t segment) const;
  absl::StatusOr<Rows> ReadSegment(const Segment& segment, int64_t rows) const;
  // Appends the rows that a batch gives the segment to `read`. They have passed all checks before.
  static absl::Status ReadBatch(const JournalBatch& batch, BatchReplay& replay,
                                SampleChecks& checks, RowBlock& read);
  void Remember(size_t segment, Rows rows) const;

  const ResolvedProblem& problem_;
  const double reorder_window_s_;
  const RunCuts cuts_;
  const SessionJournal* journal_ = nullptr;
  int64_t number_ = 0;

  RecordPosition position_;        // after the last row
  int64_t batches_ = 0;            // appended or passed over
  int64_t held_from_ = 0;          // as of SetHeldFrom
  std::vector<Segment> segments_;  // the complete ones
  size_t released_ = 0;            // the first so many of them are only in the journal
  Segment open_;                   // batches are added to it; its rows are in `tail_`
  RowBlock tail_;
  mutable std::array<Used, 2> used_;  // the segments used last, the latest first
};

}  // namespace polyest::internal
