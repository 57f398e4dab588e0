#pragma once

// Computes contour lines of a function on a grid by marching squares. In each cell, the level
// crosses an edge whose ends lie on either side of it, at the point found by linear interpolation.
// The mean of the four corners decides a saddle (all four edges crossed). The error is O(h²) in the
// spacing h.

#include <array>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

struct ContourLine {
  std::vector<std::array<double, 2>> points;  // (x, y), along the line
  bool closed = false;                        // the last point joins the first
};

// Returns the contour lines of `value` at `level`. `value` is x.size() × y.size(); x and y must
// increase strictly. Cells with a corner that is not finite are left out.
std::vector<ContourLine> ContourLines(const Vector& x, const Vector& y, const Matrix& value,
                                      double level);

// A function on a grid: value is x.size() × y.size().
struct ContourGrid {
  Vector x;
  Vector y;
  Matrix value;
};

// Returns the function on a grid with `parts` cells in each cell, by cubic interpolation along x
// and then along y (Catmull and Rom; exact for quadratics on even grids, so the contours of a
// quadratic bowl stay ellipses). Where one of the values it needs is not finite, the interpolation
// is linear.
ContourGrid RefinedGrid(const Vector& x, const Vector& y, const Matrix& value, Eigen::Index parts);

// Returns `count` levels between the least and the largest finite value. Their distances from the
// least value grow as squares, so that the contours of a quadratic bowl are evenly spaced. Returns
// none when the values do not vary.
std::vector<double> BowlLevels(const Matrix& value, int count);

}  // namespace polyest::internal
