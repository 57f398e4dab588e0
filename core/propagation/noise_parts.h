#pragma once

// Divides an interval into the parts over which Simpson's rule adds process noise
// (filter_block.h).

#include <vector>

namespace polyest::internal {

// An interval is divided evenly into at most so many parts.
inline constexpr int kMaxEvenParts = 16;

// Sets `ends_s` to the ends of the parts of (start_s, end_s], for a model whose fastest mode has
// the rate λ in 1/s. Even parts have λ h ≤ 1. If that were more than kMaxEvenParts, only those
// next to the end have h = 1/λ: what a mode was given longer ago than a few of its time constants
// has died out, so that further away only slower modes matter, and h is a sixteenth of the time to
// the end. That is wrong for fast modes that hardly die out; sampled so rarely, they cannot be told
// apart from slower ones in any case. A rate that is not finite counts as kMaxEvenParts even
// parts.
void DivideForNoise(double start_s, double end_s, double rate, std::vector<double>& ends_s);

}  // namespace polyest::internal
