#pragma once

// Contour lines of a function given on a grid, by marching squares: in each cell the level crosses
// an edge where its ends lie on either side, at the point found by linear interpolation; a saddle
// (all four edges crossed) is decided by the mean of the four corners. Error O(h²) in the spacing.

#include <array>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

struct ContourLine {
  std::vector<std::array<double, 2>> points;  // (x, y), along the line
  bool closed = false;                        // the last point joins the first
};

// value is x.size() × y.size(); x and y strictly increasing. Cells with a corner that is not finite
// are left out.
std::vector<ContourLine> ContourLines(const Vector& x, const Vector& y, const Matrix& value,
                                      double level);

// `count` levels between the least and the largest finite value, spaced by the square: lines of a
// quadratic bowl are then evenly spaced. None when the values do not vary.
std::vector<double> BowlLevels(const Matrix& value, int count);

}  // namespace polyest::internal
