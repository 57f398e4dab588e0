#pragma once

// The colours of plots, which readers with any kind of colour vision can tell apart.

#include <array>
#include <cstddef>

namespace polyest::internal {

inline constexpr char kBlue[] = "#1f4e9c", kLightBlue[] = "#6ba3e0", kOrange[] = "#d95f02",
                      kTeal[] = "#1b9e77", kMagenta[] = "#c2185b", kGray[] = "#888888",
                      kDarkGray[] = "#555555";

// Returns the colour of the i-th of several lines; it repeats after six.
inline const char* ColorOfLine(size_t i) {
  constexpr std::array<const char*, 6> kColors = {kBlue,    kOrange,   kTeal,
                                                  kMagenta, "#7570b3", "#a6761d"};
  return kColors[i % kColors.size()];
}

}  // namespace polyest::internal
