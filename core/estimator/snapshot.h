#pragma once

// Encodes the state of an estimator as bytes and decodes it: cereal's portable binary archive, with
// doubles bit for bit, a version, a fingerprint of the problem and a checksum.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/estimator/posterior/component_state.h"

namespace polyest::internal {

// The states of the mixture's components, all at the same row, and of the mixture.
struct EstimatorState {
  std::vector<ComponentState> components;
  int64_t weighing_row = 0;
  double left_out = 0;
  int elements_left_out = 0;
  int reexpansions = 0;
  int64_t propagated_rows = 0;
};

// Version of the format. Raise it with every change in the meaning of the bytes or in what is
// computed from them.
inline constexpr uint32_t kSnapshotVersion = 4;

// Encodes the state of an estimator after `rows` rows of the problem of that fingerprint.
std::string EncodeState(const EstimatorState& state, int64_t rows, uint32_t fingerprint);

// Decodes a snapshot of `rows` rows. Returns DataLoss for bytes that are truncated, corrupted or
// not a snapshot of so many rows, and FailedPrecondition for another version or fingerprint. Memory
// is bounded by a multiple of the number of bytes, whatever they contain. The components' FromState
// checks that the state suits the problem.
absl::StatusOr<EstimatorState> DecodeState(std::string_view bytes, int64_t rows,
                                           uint32_t fingerprint);

}  // namespace polyest::internal
