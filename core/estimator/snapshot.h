#pragma once

// The state of an estimator as bytes, and back: cereal's portable binary archive, doubles with all
// their bits, with a version, a fingerprint of the problem and a checksum.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/estimator/posterior/component_state.h"

namespace polyest::internal {

// Of the components of the posterior's mixture, all at the same row, and of the mixture.
struct EstimatorState {
  std::vector<ComponentState> components;
  int64_t weighing_row = 0;
  double left_out = 0;
  int reexpansions = 0;
  int64_t propagated_rows = 0;
};

// To be raised with every change of what the bytes mean, and of what is computed from them.
inline constexpr uint32_t kSnapshotVersion = 1;

std::string EncodeState(const EstimatorState& state, int64_t rows, uint32_t fingerprint);

// DATA_LOSS for bytes that are not of a snapshot of so many rows, cut off or corrupted;
// FAILED_PRECONDITION for another version or fingerprint. Bounded in memory by a multiple of the
// bytes, whatever they are. That the state suits the problem, FromState of its components sees to.
absl::StatusOr<EstimatorState> DecodeState(std::string_view bytes, int64_t rows,
                                           uint32_t fingerprint);

}  // namespace polyest::internal
