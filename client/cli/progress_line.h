#pragma once

// A line on the terminal that says what long work is doing.

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

// Shows "<what> · 12 s" at the end of the standard error once the work has taken half a second, and
// takes it away at the end. Shows nothing where the standard error is no terminal, so that scripts
// and logs never see it. For one thread, `Interject` apart.
class ProgressLine {
 public:
  // `describe` is called from a thread of the line's own until the line ends.
  explicit ProgressLine(std::function<std::string()> describe);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  // Calls `print` while the line is away. Any thread may.
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

// Keeps how far an estimator is with its record. The estimator's thread writes, others read.
class EstimationProgress {
 public:
  // "row 128 of 800", "re-expanding, row 64 of 800", "assessing the estimate".
  std::string Describe() const;

 private:
  friend class WatchedStore;

  std::atomic<int64_t> rows_{0};    // in the record
  std::atomic<int64_t> taken_{0};   // read at least once
  std::atomic<int64_t> latest_{0};  // up to where the last read went
};

// A sample store in memory that notes which rows the estimator reads: rows past all read before are
// being taken, earlier rows are propagated again on a moved expansion.
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
