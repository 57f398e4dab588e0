#pragma once

// A store for problems in which samples need the streamed inputs ahead of their own times, because
// delays are negative (ResolvedProblem::lead_s). The samples at the end of a run would need inputs
// after their last values: they are read as missing.

#include <memory>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/samples.h"

namespace polyest::internal {

class KnownInputsStore final : public SampleStore {
 public:
  // Keeps the rows in `store`, which must have none.
  KnownInputsStore(const ResolvedProblem& problem, std::shared_ptr<SampleStore> store);

  int64_t rows() const override { return store_->rows(); }
  absl::Status Append(const RowBlock& block) override;
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override;

 private:
  struct Run {
    int number = 0;
    double known_to_s = 0;  // the time up to which all its inputs are known
  };

  const std::shared_ptr<SampleStore> store_;
  const size_t channels_;
  const double lead_s_;
  const std::vector<int> knots_needed_;  // by streamed input
  std::vector<Run> runs_;                // in order; those that have rows
  std::vector<double> known_to_s_;       // by streamed input, in the last run
};

// Returns the store in which an estimator of the problem keeps its rows: `store`, or one in memory
// if that is null, as a KnownInputsStore if need be.
std::shared_ptr<SampleStore> StoreFor(const ResolvedProblem& problem,
                                      std::shared_ptr<SampleStore> store);

}  // namespace polyest::internal
