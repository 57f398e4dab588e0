#include "core/estimator/record/known_inputs_store.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/common/status.h"
#include "core/estimator/record/memory_store.h"

namespace polyest::internal {

KnownInputsStore::KnownInputsStore(const ResolvedProblem& problem,
                                   std::shared_ptr<SampleStore> store)
    : store_(std::move(store)),
      channels_(static_cast<size_t>(problem.channels())),
      lead_s_(problem.lead_s()),
      knots_needed_(problem.knots_needed()),
      known_to_s_(knots_needed_.size()) {}

absl::Status KnownInputsStore::Append(const RowBlock& block) {
  POLYEST_RETURN_IF_ERROR(store_->Append(block));
  const size_t width = channels_ + known_to_s_.size();
  for (size_t k = 0; k < block.rows.size(); ++k) {
    const SampleRow& row = block.rows[k];
    if (runs_.empty() || runs_.back().number != row.run) {
      runs_.push_back({row.run, 0});
      std::ranges::fill(known_to_s_, -kInfinity);
    }
    for (size_t i = 0; i < known_to_s_.size(); ++i) {
      // A held input keeps its value where there is no other.
      const bool held = knots_needed_[i] == 0 && std::isfinite(known_to_s_[i]);
      if (held || !std::isnan(block.values[k * width + channels_ + i])) known_to_s_[i] = row.time_s;
    }
    runs_.back().known_to_s = *std::ranges::min_element(known_to_s_);
  }
  return absl::OkStatus();
}

absl::Status KnownInputsStore::Read(int64_t first, int64_t count, RowBlock& block) const {
  POLYEST_RETURN_IF_ERROR(store_->Read(first, count, block));
  const size_t width = channels_ + known_to_s_.size();
  for (size_t k = 0; k < block.rows.size(); ++k) {
    const SampleRow& row = block.rows[k];
    const auto run = std::ranges::lower_bound(runs_, row.run, {}, &Run::number);
    // Compared as RunInputs does, so that rounding tells the two the same.
    if (row.time_s + lead_s_ <= run->known_to_s) continue;
    std::fill_n(block.values.begin() + static_cast<std::ptrdiff_t>(k * width), channels_,
                std::numeric_limits<double>::quiet_NaN());
    std::fill_n(block.noise.begin() + static_cast<std::ptrdiff_t>(k * channels_), channels_, 0);
  }
  return absl::OkStatus();
}

std::shared_ptr<SampleStore> StoreFor(const ResolvedProblem& problem,
                                      std::shared_ptr<SampleStore> store) {
  if (!store) store = std::make_shared<MemoryStore>();
  if (problem.lead_s() == 0) return store;
  return std::make_shared<KnownInputsStore>(problem, std::move(store));
}

}  // namespace polyest::internal
