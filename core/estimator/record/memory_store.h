#pragma once

#include "polyest/samples.h"

namespace polyest::internal {

// A sample store in memory.
class MemoryStore final : public SampleStore {
 public:
  int64_t rows() const override { return static_cast<int64_t>(record_.rows.size()); }
  absl::Status Append(const RowBlock& block) override;
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override;

 private:
  RowBlock record_;
};

}  // namespace polyest::internal
