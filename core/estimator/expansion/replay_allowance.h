#pragma once

// The bound on the rows that one update propagates again (ExpansionOptions::max_replay_row_count).
//
// A component of the posterior may propagate as many rows again as the limit says. What it has used
// comes back by one row with each row of the record, so that while the record grows by B rows at
// most limit + B rows are propagated again, however these were cut into batches. Rows are counted
// and not seconds, because a result must not depend on the speed of a machine.

#include <algorithm>
#include <cstdint>
#include <optional>

namespace polyest::internal {

// Largest shift, in posterior standard deviations, that sums taken over may cause where the limit
// forbids to propagate the record again. The uncertainty is widened by it.
inline constexpr double kMaxShiftUnderLimit = 0.25;

class ReplayAllowance {
 public:
  explicit ReplayAllowance(std::optional<int64_t> limit = std::nullopt) : limit_(limit) {}

  // Whether `rows` rows may be propagated again after the first `taken` rows of the record.
  bool Allows(int64_t taken, int64_t rows) const {
    return !limit_ || taken == exempt_at_ || UsedAt(taken) + rows <= *limit_;
  }
  // Whether the whole record of `taken` rows may be.
  bool AllowsRecord(int64_t taken) const { return Allows(taken, taken); }
  // Counts `rows` rows as propagated again after the first `taken` rows.
  void Use(int64_t taken, int64_t rows) {
    if (!limit_) return;
    used_ = UsedAt(taken) + rows;
    used_at_ = taken;
  }
  // Lifts the limit at a row at which the estimator cannot go on otherwise.
  void ExemptAt(int64_t taken) {
    if (limit_) exempt_at_ = taken;
  }

  // What a snapshot keeps; the limit is the problem's.
  struct State {
    int64_t used = 0, used_at = 0, exempt_at = -1;
  };
  State state() const { return {used_, used_at_, exempt_at_}; }
  // Whether a state can be that after `taken` rows.
  static bool IsState(const State& state, int64_t taken) {
    constexpr int64_t kMost = int64_t{1} << 60;
    return state.used >= 0 && state.used < kMost && state.used_at >= 0 && state.used_at <= taken;
  }
  void Restore(const State& state) {
    used_ = state.used;
    used_at_ = state.used_at;
    exempt_at_ = state.exempt_at;
  }

 private:
  int64_t UsedAt(int64_t taken) const { return std::max<int64_t>(0, used_ - (taken - used_at_)); }

  std::optional<int64_t> limit_;
  int64_t used_ = 0;  // rows, when the record had so many:
  int64_t used_at_ = 0;
  int64_t exempt_at_ = -1;  // row; -1: none
};

// What the limit has put off, each with the number of rows after which it was; 0: nothing.
struct Postponed {
  int64_t expansion = 0;  // a move of the expansion, or a higher order
  int64_t noise = 0;      // a revision of the noise that is learned
  int64_t tolerance = 0;  // a tighter tolerance of the integrators

  bool any() const { return expansion > 0 || noise > 0 || tolerance > 0; }
  // Takes over what `other` has put off, each since the earlier row.
  void Include(const Postponed& other) {
    for (int64_t Postponed::*row :
         {&Postponed::expansion, &Postponed::noise, &Postponed::tolerance}) {
      if (other.*row == 0) continue;
      this->*row = this->*row == 0 ? other.*row : std::min(this->*row, other.*row);
    }
  }
};

}  // namespace polyest::internal
