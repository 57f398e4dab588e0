#pragma once

// Functions given by values on a grid, y = f(x) or z = f(x, y), and their slopes.
//
// A linear table interpolates linearly between neighbours, bilinearly in two dimensions. A spline
// table is the natural cubic spline, whose second derivative vanishes at the ends,
//
//   s(x) = a f_i + b f_{i+1} + (a³ − a) h²/6 M_i + (b³ − b) h²/6 M_{i+1},
//   a = (x_{i+1} − x)/h,  b = 1 − a,  M the second derivatives at the knots,
//
// and in two dimensions the product of such splines. Outside the grid the value is that at the
// nearest end, and the slope is 0. At a knot of a linear table the slope is that of the interval to
// its right. Source: C. de Boor, A Practical Guide to Splines, chapter IV.

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "polyest/equation_model.h"

namespace polyest::internal::equations {

// Returns InvalidArgument that names the invalid member, such as "x[2]".
absl::Status CheckTable(const LookupTable& table);

class Lookup {
 public:
  explicit Lookup(LookupTable table);  // must pass CheckTable

  bool two_dimensional() const { return !table_.y.empty(); }
  // Return the value and the slopes ∂/∂x and ∂/∂y at a point, NaN for a NaN argument. A table of
  // one dimension ignores y.
  double Value(double x, double y) const { return Evaluate(x, y, 0, 0); }
  double SlopeX(double x, double y) const { return Evaluate(x, y, 1, 0); }
  double SlopeY(double x, double y) const { return Evaluate(x, y, 0, 1); }

 private:
  double Evaluate(double x, double y, int order_x, int order_y) const;

  LookupTable table_;
  // For a spline: ∂²/∂x², ∂²/∂y² and ∂⁴/∂x²∂y² at the knots, in the layout of the values.
  std::vector<double> curvature_x_, curvature_y_, curvature_xy_;
};

}  // namespace polyest::internal::equations
