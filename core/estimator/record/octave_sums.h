#pragma once

// A histogram of magnitudes by octaves, which tells their usual size in constant memory.

#include <cstdint>

#include "core/common/types.h"

namespace polyest::internal {

class OctaveSums {
 public:
  void Add(double magnitude);  // ≥ 0

  // Returns the mean of those in the octave [2^k, 2^(k+1)) that holds the median; 0 without any.
  double Usual() const;
  // Returns how many lie in octaves whose mean is above the limit.
  int64_t CountAbove(double limit) const;
  int64_t count() const { return static_cast<int64_t>(count_.sum()); }

  bool IsConsistent() const;  // false after reading what was never written

  template <class Archive>
  void serialize(Archive& archive) {
    archive(count_, sum_);
  }

 private:
  // Octaves from 2⁻⁶⁴, which is 5·10⁻²⁰, to 2⁶⁴; the first and the last also take what is beyond.
  static constexpr int kOctaves = 128;
  static int OctaveOf(double magnitude);

  Vector count_ = Vector::Zero(kOctaves), sum_ = Vector::Zero(kOctaves);
};

}  // namespace polyest::internal
