#pragma once

// The mismatch sums of consecutive windows of the record, in bounded memory and without work for
// every sample. At the end of each window the sums of all rows so far are copied; those of a window
// are the difference of two copies, so the totals are never touched. All windows are equally many
// rows long. When there is no room for another one, neighbours are merged by dropping every other
// copy, and the length doubles. The windows are therefore a function of the rows alone.
//
// A copy takes S²/2 numbers for all channels with noise of known size together, and as many for
// each channel with a learned scale, because the weight of such a channel's residuals depends on
// its χ². The number of windows is limited to 64, or less where copies are large.

#include <cstdint>
#include <utility>
#include <vector>

#include "core/bayes/mismatch.h"
#include "core/common/types.h"

namespace polyest::internal {

// The rows of a window.
struct WindowSpan {
  int64_t rows = 0;
  int first_run = 0, last_run = 0;
  double start_s = 0;  // time of its first row in first_run
  double end_s = 0;    // time of its last row in last_run

  // cereal calls this for writing and for reading.
  template <class Archive>
  void serialize(Archive& archive) {
    archive(rows, first_run, last_run, start_s, end_s);
  }
};

class WindowSums {
 public:
  // G and b of all rows up to the end of a window (mismatch_sums.h), for channels of one group.
  struct Totals {
    Vector g;  // lower triangle of G by columns, S (S + 1)/2
    Vector b;  // S

    // cereal calls this for writing and for reading.
    template <class Archive>
    void serialize(Archive& archive) {
      archive(g, b);
    }
  };

  // Ends a row whose samples have been added to `sums`. Takes O(1) operations, but O(S²) at the end
  // of a window. Channels and their kinds of noise must be those of earlier calls.
  void EndRow(const std::vector<ChannelSums>& sums, int run, double time_s) {
    EndRow(sums, run, time_s, time_s);
  }
  // Ends what counts as one row and lasts from `start_s` to `end_s`, in the same way.
  void EndRow(const std::vector<ChannelSums>& sums, int run, double start_s, double end_s);

  // Replaces the terms φ by others φ′ with φ ≈ Tᵀφ′, as MismatchSums::Substituted does: `t` is
  // S′ × S, `shift` = δ (S).
  void Substitute(const ConstMatrixRef& t, const ConstVectorRef& shift);

  // Divides the sums of each channel by its factor (m). Channels without a learned scale must have
  // the factor 1.
  void Divide(const Vector& factors, const std::vector<ChannelSums>& sums);

  // Returns the number of windows, including the present one, if it has rows.
  int count() const { return static_cast<int>(closed_) + (open_.rows > 0 ? 1 : 0); }
  const WindowSpan& span(int window) const;
  // Returns the totals at the end of a window, one for each group of channels: of all channels
  // without a learned scale, if there are any, then of each other one in order. `sums` are those of
  // the last EndRow.
  std::vector<Totals> TotalsAt(int window, const std::vector<ChannelSums>& sums) const;
  // Returns whether the windows can be those of `rows` rows with such sums.
  bool Suits(const std::vector<ChannelSums>& sums, int64_t rows) const;

  // Returns the maximum number of windows, even and between 16 and 64.
  static int Capacity(const std::vector<ChannelSums>& sums);
  // Returns the symmetric matrix (S × S) whose lower triangle is `packed`.
  static Matrix Unpack(const Vector& packed, int terms);

  // cereal calls these.
  template <class Archive>
  void save(Archive& archive) const {
    archive(length_, static_cast<int64_t>(closed_));
    archive(open_);
    for (size_t i = 0; i < closed_; ++i) {
      archive(windows_[i].span);
      archive(windows_[i].totals);
    }
  }
  template <class Archive>
  void load(Archive& archive) {
    int64_t closed = 0;
    archive(length_, closed);
    archive(open_);
    windows_.clear();
    for (int64_t i = 0; i < closed; ++i) {
      Window& window = windows_.emplace_back();
      archive(window.span);
      archive(window.totals);
    }
    closed_ = windows_.size();
  }

 private:
  struct Window {
    WindowSpan span;
    std::vector<Totals> totals;
  };

  void MergeNeighbours();

  int64_t length_ = 1;           // rows of a closed window
  size_t closed_ = 0;            // number of closed windows
  std::vector<Window> windows_;  // beyond closed_: memory for windows to come
  WindowSpan open_;              // the present window, which has no copy yet
};

}  // namespace polyest::internal
