#pragma once

// Encodes the state of an estimator as bytes and decodes it: cereal's portable binary archive, with
// doubles bit for bit, a version, a fingerprint of the problem and a checksum.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "core/estimator/mixture_state.h"
#include "core/estimator/second_search.h"

namespace polyest::internal {

struct EstimatorState {
  MixtureState mixture;
  SecondSearch::State search;
};

// Version of the format. Raise it with every change in the meaning of the bytes or in what is
// computed from them.
inline constexpr uint32_t kSnapshotVersion = 21;

// Encodes the state of an estimator after `rows` rows of the problem of that fingerprint.
std::string EncodeState(const EstimatorState& state, int64_t rows, uint32_t fingerprint);

// Decodes a snapshot of `rows` rows. Returns DataLoss for bytes that are truncated, corrupted or
// not a snapshot of so many rows, and FailedPrecondition for another version or fingerprint. Memory
// is bounded by a multiple of the number of bytes, whatever they contain. The components' FromState
// checks that the state suits the problem.
absl::StatusOr<EstimatorState> DecodeState(std::string_view bytes, int64_t rows,
                                           uint32_t fingerprint);

}  // namespace polyest::internal
