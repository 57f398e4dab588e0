#pragma once

// Puts rows that arrive out of order into time order. A channel may reach the daemon later than
// another, so that its rows come after rows of later times. Rows are held back until the newest row
// of their run is more than a window ahead of them, or the run ends; then they are released in time
// order, and samples of different channels at the same time become one row.
//
// The rows released are a function of the batches alone: batches that a journal keeps give the same
// rows again. Their order depends neither on the order in which they arrived nor on how they were
// cut into batches.

#include <absl/status/statusor.h>

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/common/field_error.h"
#include "polyest/samples.h"

namespace polyest::internal {

// Returns OK for a window in [0, 3600] s; 0: rows must come in time order. Otherwise
// INVALID_ARGUMENT naming `field`.
absl::Status CheckReorderWindow(const FieldPath& field, double window_s);

class RowReorder {
 private:
  struct Earlier {
    bool operator()(const SampleRow& a, const SampleRow& b) const {
      return a.run != b.run ? a.run < b.run : a.time_s < b.time_s;
    }
  };
  // The values of each row, one for each of columns_; NaN where missing.
  using Rows = std::map<SampleRow, std::vector<double>, Earlier>;
  struct Batch {
    int64_t number = 0;
    SampleRow newest;  // the newest of its rows
  };

 public:
  // The largest number of rows held back.
  static constexpr int64_t kMaxHeldRows = 100'000;

  // Says where a sequence of batches begins that is to release the same rows once more.
  struct Resumption {
    int64_t first_batch = 1;            // the batch that comes next
    std::optional<SampleRow> released;  // the last row released before; none: no row was
  };

  // A batch that has been checked, and the rows that it releases.
  class Step {
   public:
    // In time order; no rows if all are held back. Its end_of_run tells that the last row's run has
    // no further rows.
    Samples released;

   private:
    friend class RowReorder;
    Rows added;                    // and still held back
    std::list<Batch> batch;        // one, if it has rows
    int64_t released_of_held = 0;  // rows released that were held back before the batch
    bool any = false;
    SampleRow newest;
    bool run_ended = false;
  };

  // `columns`: the names that columns may have. `window_s` > 0.
  RowReorder(std::vector<std::string> columns, double window_s);
  // Resumes: the batches must be those that came the first time, from held_from() at that time on.
  // Their rows up to the last one released are passed over; the others are held back and released
  // as before.
  RowReorder(std::vector<std::string> columns, double window_s, const Resumption& from);

  // Takes rows in any order; the columns' names, the values and the times have been checked.
  // Refuses the whole batch with INVALID_ARGUMENT, naming row, columns and times, if a row is older
  // than the newest one of its run by more than the window, if its run has ended, or if its channel
  // has another sample at the same time; with RESOURCE_EXHAUSTED past kMaxHeldRows.
  absl::StatusOr<Step> Next(const Samples& batch) const;
  // Goes on to the state after the step; needs no memory.
  void Accept(Step step);

  // Returns the number of the earliest batch of which a row is held back; that of the next batch if
  // none is.
  int64_t held_from() const { return batches_.empty() ? next_ : batches_.front().number; }
  // Returns the number of rows held back.
  int64_t held_rows() const { return static_cast<int64_t>(held_.size()); }
  // Returns about how many bytes of memory these take: some 100 and 8 for each column, a row.
  int64_t held_bytes() const;
  // Returns whether these say nothing: neither a row nor the end of a run.
  static bool IsNothing(const Samples& released) {
    return released.rows() == 0 && !released.end_of_run;
  }

 private:
  absl::Status AddRow(const Samples& batch, size_t row, const std::vector<size_t>& places,
                      Step& step) const;
  absl::Status CheckPlace(const Samples& batch, size_t row, const SampleRow& place,
                          const Step& step) const;
  bool IsDue(const SampleRow& place, const Step& step) const;
  void Release(Step& step) const;
  bool Holds(const Rows& rows, const SampleRow& place, size_t column) const;

  const std::vector<std::string> columns_;
  const double window_s_;
  const std::optional<SampleRow> passed_over_;  // rows up to here were released before
  int64_t next_;                                // number of the next batch
  bool any_;                                    // whether there has been a row
  SampleRow newest_;
  bool run_ended_ = false;  // whether the newest row's run has no further rows
  Rows held_;
  std::list<Batch> batches_;  // those with rows held back, and maybe others behind the first
};

}  // namespace polyest::internal
