#pragma once

// Shows the progress of long work in a line on the terminal.

#include <absl/functional/function_ref.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "polyest/samples.h"

namespace polyest::internal {

// Shows "<description> · 12 s" on the standard error once the work has taken half a second, and
// erases it in the destructor. Shows nothing if the standard error is no terminal, so that scripts
// and logs never contain it. All functions except Interject must be called from one thread.
class ProgressLine {
 public:
  // `describe` returns the description. It is called from another thread until the destructor ends.
  explicit ProgressLine(std::function<std::string()> describe);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  // Erases the line and calls `print`. Any thread may call it.
  void Interject(absl::FunctionRef<void()> print);

 private:
  using Clock = std::chrono::steady_clock;

  void Run();
  void Draw();
  void Erase();

  const std::function<std::string()> describe_;
  const Clock::time_point start_ = Clock::now();
  std::mutex mutex_;
  std::condition_variable ends_;
  bool ending_ = false;
  bool shown_ = false;
  std::thread thread_;
};

// Progress of an estimator through its record. The estimator's thread writes it, others read it.
class EstimationProgress {
 public:
  // Returns a text like "row 128 of 800", "re-expanding, row 64 of 800" or "all 800 rows taken,
  // assessing the posterior".
  std::string Describe() const;

 private:
  friend class WatchedStore;

  std::atomic<int64_t> rows_{0};    // number of rows in the record
  std::atomic<int64_t> taken_{0};   // number of rows read at least once
  std::atomic<int64_t> latest_{0};  // row at which the last read ended
};

// A sample store in memory that records which rows the estimator reads. Rows that it reads for the
// first time are new; rows that it reads again are propagated again on a new expansion.
class WatchedStore final : public SampleStore {
 public:
  explicit WatchedStore(std::shared_ptr<EstimationProgress> progress);
  int64_t rows() const override { return store_->rows(); }
  absl::Status Append(const RowBlock& block) override;
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override;

 private:
  std::shared_ptr<EstimationProgress> progress_;
  std::unique_ptr<SampleStore> store_;
};

}  // namespace polyest::internal
