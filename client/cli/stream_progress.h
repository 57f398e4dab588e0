#pragma once

// Keeps how far `polyest stream` is, for its line of progress.

#include <atomic>
#include <cstdint>
#include <string>

namespace polyest::internal {

// One thread writes the rows and another the estimates; any may read.
class StreamProgress {
 public:
  // Counts the rows of a regular file, so that its progress has an end; leaves anything else, which
  // reading would use up, alone.
  void CountRowsOf(int descriptor);
  void AddRows(int rows) { rows_ += rows; }
  void SetEstimateTime(double time_s) {
    estimate_time_s_ = time_s;
    estimated_ = true;
  }

  // Returns "row 90 of 800 sent, estimate up to t = 4.5 s".
  std::string Describe() const;

 private:
  std::atomic<int64_t> rows_{0};
  std::atomic<int64_t> rows_of_file_{0};  // 0: not known
  std::atomic<double> estimate_time_s_{0};
  std::atomic<bool> estimated_{false};
};

}  // namespace polyest::internal
