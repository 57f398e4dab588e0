#pragma once

// The rule that makes a stream safe to resume: batches are numbered 1, 2, 3 …; the last one may be
// sent again, for a client that does not know whether it arrived, and counts once.

#include <absl/status/statusor.h>
#include <absl/strings/str_format.h>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "polyest/v1/measurements.pb.h"

namespace polyest {

class BatchSequence {
 public:
  enum class Place { kNext, kRepeat };

  int64_t last() const { return last_; }

  // INVALID_ARGUMENT, naming the number expected, for anything but the next batch or a repeat of
  // the last one with the same content.
  absl::StatusOr<Place> Check(int64_t sequence, const v1::Measurements& batch) const {
    if (sequence == last_ + 1) return Place::kNext;
    if (sequence != last_ || last_ == 0) {
      return absl::InvalidArgumentError(
          absl::StrFormat("sequence: %d must be %d, one more than the last batch acknowledged",
                          sequence, last_ + 1));
    }
    if (Digest(batch) != digest_) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "sequence: %d was acknowledged with other measurements; the next batch must be %d",
          sequence, last_ + 1));
    }
    return Place::kRepeat;
  }

  void Accept(const v1::Measurements& batch) {
    ++last_;
    digest_ = Digest(batch);
  }

 private:
  static size_t Digest(const v1::Measurements& batch) {
    return std::hash<std::string_view>()(batch.SerializeAsString());
  }

  int64_t last_ = 0;
  size_t digest_ = 0;
};

}  // namespace polyest
