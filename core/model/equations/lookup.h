#pragma once

// Functions given by values on a grid, y = f(x) or z = f(x, y), with their slopes.
//
// Linear: between neighbours, bilinear in two dimensions. Spline: the natural cubic spline, whose
// second derivative vanishes at the ends,
//
//   s(x) = a f_i + b f_{i+1} + (a³ − a) h²/6 M_i + (b³ − b) h²/6 M_{i+1},
//   a = (x_{i+1} − x)/h,  b = 1 − a,  M the second derivatives at the knots,
//
// and in two dimensions the product of such splines. Outside of the grid the value is that of the
// nearest end and the slope 0. At a knot of a linear table the slope is that to its right.
// Source: C. de Boor, A Practical Guide to Splines, chapter IV.

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "polyest/equation_model.h"

namespace polyest::internal::equations {

// INVALID_ARGUMENT names the member at fault, "x[2]".
absl::Status CheckTable(const LookupTable& table);

class Lookup {
 public:
  explicit Lookup(LookupTable table);  // one that CheckTable has nothing against

  bool two_dimensional() const { return !table_.y.empty(); }
  // NaN of NaN. y is not looked at in one dimension.
  double Value(double x, double y) const { return Evaluate(x, y, 0, 0); }
  double SlopeX(double x, double y) const { return Evaluate(x, y, 1, 0); }
  double SlopeY(double x, double y) const { return Evaluate(x, y, 0, 1); }

 private:
  double Evaluate(double x, double y, int order_x, int order_y) const;

  LookupTable table_;
  // Of a spline, in the layout of the values: ∂²/∂x², ∂²/∂y² and ∂⁴/∂x²∂y² at the knots.
  std::vector<double> curvature_x_, curvature_y_, curvature_xy_;
};

}  // namespace polyest::internal::equations
