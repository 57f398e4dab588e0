#pragma once

// Records the progress of `polyest stream` for its line of progress.

#include <atomic>
#include <cstdint>
#include <string>

namespace polyest::internal {

// One thread writes the rows and another the estimates; any thread may read.
class StreamProgress {
 public:
  // Counts the rows of a regular file, so that the progress shows their total. Does not read other
  // descriptors, such as pipes, because that would consume their data.
  void CountRowsOf(int descriptor);
  void AddRows(int rows) { rows_ += rows; }
  void SetEstimateTime(double time_s) {
    estimate_time_s_ = time_s;
    estimated_ = true;
  }

  // Returns a text like "row 90 of 800 sent, estimate up to t = 4.5 s".
  std::string Describe() const;

 private:
  std::atomic<int64_t> rows_{0};
  std::atomic<int64_t> rows_of_file_{0};  // 0: unknown
  std::atomic<double> estimate_time_s_{0};
  std::atomic<bool> estimated_{false};
};

}  // namespace polyest::internal
