#pragma once

// When a mixture component looks at its expansion: at the ends of windows, at the region's edges
// between them, ahead of need over a long record, and before a row that the expansion does not
// follow. All rows are counted in the record, and all decisions are functions of them alone.
//
// The time from one look to the next is a part of the record since the windows' beginning, so that
// the looks become rarer as the record grows.

#include <cstdint>

namespace polyest::internal {

// Returns the row at which a window starting at `rows` ends. Windows grow in proportion to the
// number of rows since `from` and have at least two rows.
int64_t NextWindow(int64_t rows, int64_t from = 0);

class ReexpansionSchedule {
 public:
  // The most re-expansions that are attempted at a row.
  static constexpr int kMaxAttemptsAtRow = 4;

  // Plain data, in the order in which snapshots store it.
  struct State {
    int64_t windows_from = 0;     // row from which the present windows are counted
    int64_t window_end = 2;       // row at which the present window ends
    int64_t edges_row = 2;        // row at which to look at the region's edges next
    int64_t ahead_row = 0;        // no move ahead of need before this row
    int64_t patient_until = 0;    // rows before this one are taken regardless of residual
    int64_t whole_until = 0;      // no search for pieces before this row
    int64_t attempted_row = -1;   // row before which the last re-expansion was attempted
    int attempts_at_row = 0;      // attempted there
    int64_t comparable_row = -1;  // rows at which a weighing was prepared last

    template <class Archive>
    void serialize(Archive& archive) {
      archive(windows_from, window_end, edges_row, ahead_row, patient_until, whole_until,
              attempted_row, attempts_at_row, comparable_row);
    }
  };
  const State& state() const { return state_; }
  void Restore(const State& state) { state_ = state; }
  // Whether a component that has taken so many rows can have this state.
  static bool IsState(const State& state, int64_t rows) {
    return state.windows_from >= 0 && state.windows_from <= rows && state.attempts_at_row >= 0;
  }

  // Below, `rows` are the rows that the component has taken.

  bool WindowEnds(int64_t rows) const { return rows >= state_.window_end; }
  bool LooksAtEdges(int64_t rows) const { return rows >= state_.edges_row; }
  bool MayLookAhead(int64_t rows) const { return rows >= state_.ahead_row; }
  // Whether the next row is taken with its discount, however large its residual is.
  bool ToleratesResiduals(int64_t rows) const { return rows < state_.patient_until; }
  // Whether the component stays undivided.
  bool StaysWhole(int64_t rows) const { return rows < state_.whole_until; }
  bool IsComparable(int64_t rows) const { return rows == state_.comparable_row; }

  // Returns the row at which weights of outliers that were taken at `rows` are to be taken anew:
  // until then the minimum about which they were taken has moved by a part of a standard deviation.
  int64_t WeightsServeUntil(int64_t rows) const;
  // Begins the next window, which ends no later than `latest_end`.
  void EndWindow(int64_t rows, int64_t latest_end);
  // Puts the next look at the edges off, in proportion to the windows' length.
  void PutOffEdges(int64_t rows);
  // Looks at the edges after these rows, as some of them are not what they were.
  void LookAtEdgesAt(int64_t rows) { state_.edges_row = rows; }
  // Puts the next attempt to move ahead of need off until the record has grown by a tenth.
  void PutOffLookAhead(int64_t rows);
  // Ends the looks after the row, of which there is one.
  void EndRow(int64_t rows);

  // Begins an attempt to re-expand before the next row. Returns whether fewer than
  // kMaxAttemptsAtRow have been made there; each is then counted by CountAttempt.
  bool MayReexpandBefore(int64_t rows);
  void CountAttempt() { ++state_.attempts_at_row; }
  // After an attempt in vain takes rows regardless of residual for a while.
  void TolerateResiduals(int64_t rows);
  // Keeps the component undivided until the next window would end.
  void StayWhole(int64_t rows) { state_.whole_until = NextWindow(rows, state_.windows_from); }
  void AllowDivision() { state_.whole_until = 0; }
  void SetComparable(int64_t rows) { state_.comparable_row = rows; }

  // Counts windows from these rows, as where a new run begins, which tells nothing yet however long
  // the record is.
  void CountAnewFrom(int64_t rows);
  // Returns the schedule of a component that is made of one with this schedule, at the same row.
  ReexpansionSchedule OfPart(int64_t rows) const;

 private:
  State state_;
};

}  // namespace polyest::internal
