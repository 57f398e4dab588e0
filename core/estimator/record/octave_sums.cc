#include "core/estimator/record/octave_sums.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

constexpr double kRounding = 1e-9;    // of a mean
constexpr double kMaxCounted = 9e15;  // up to which numbers count exactly

}  // namespace

int OctaveSums::OctaveOf(double magnitude) {
  return magnitude > 0 ? std::clamp(std::ilogb(magnitude) + kOctaves / 2, 0, kOctaves - 1) : 0;
}

void OctaveSums::Add(double magnitude) {
  const int octave = OctaveOf(magnitude);
  count_[octave] += 1;
  sum_[octave] += magnitude;
}

double OctaveSums::Usual() const {
  const double half = 0.5 * count_.sum();
  double before = 0;
  for (Eigen::Index k = 0; k < count_.size(); ++k) {
    before += count_[k];
    if (count_[k] > 0 && before >= half) return sum_[k] / count_[k];
  }
  return 0;
}

int64_t OctaveSums::CountAbove(double limit) const {
  double above = 0;
  for (Eigen::Index k = 0; k < count_.size(); ++k) {
    if (count_[k] > 0 && sum_[k] > limit * count_[k]) above += count_[k];
  }
  return std::llround(above);
}

bool OctaveSums::IsConsistent() const {
  if (count_.size() != kOctaves || sum_.size() != kOctaves) return false;
  if (!(count_.sum() <= kMaxCounted)) return false;
  for (int k = 0; k < kOctaves; ++k) {
    if (!(count_[k] >= 0) || count_[k] != std::floor(count_[k])) return false;
    // An empty octave has no sum, and another one's mean lies in it up to rounding.
    const double mean = sum_[k] / count_[k];
    if (count_[k] == 0
            ? sum_[k] != 0
            : OctaveOf(mean * (1 + kRounding)) != k && OctaveOf(mean * (1 - kRounding)) != k) {
      return false;
    }
  }
  return true;
}

}  // namespace polyest::internal
