#pragma once

#include "core/estimator/samples.h"

namespace polyest {

// Samples kept in memory.
class MemoryStore final : public SampleStore {
 public:
  int64_t rows() const override { return static_cast<int64_t>(rows_.size()); }
  absl::Status Append(const SampleRow& row, const std::vector<double>& values,
                      const std::vector<double>& noise) override;
  absl::Status Read(int64_t first, int64_t count, std::vector<SampleRow>& rows,
                    std::vector<double>& values, std::vector<double>& noise) const override;

 private:
  std::vector<SampleRow> rows_;
  std::vector<double> values_;
  std::vector<double> noise_;
};

}  // namespace polyest
