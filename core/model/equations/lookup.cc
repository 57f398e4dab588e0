#include "core/model/equations/lookup.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/status.h"

namespace polyest::internal::equations {
namespace {

absl::Status CheckGrid(const char* name, const std::vector<double>& grid) {
  if (grid.size() < 2) {
    return InvalidField(name,
                        absl::StrCat("has ", grid.size(), " values; it must have at least 2"));
  }
  for (size_t i = 0; i < grid.size(); ++i) {
    if (!std::isfinite(grid[i])) {
      return InvalidField({name, i}, absl::StrCat("is ", grid[i], "; it must be finite"));
    }
    if (i > 0 && !(grid[i] > grid[i - 1])) {
      return InvalidField({name, i}, absl::StrCat("is ", grid[i], " after ", grid[i - 1],
                                                  "; the values must strictly increase"));
    }
  }
  return absl::OkStatus();
}

// Computes the second derivatives M at the knots of the natural cubic spline through values that
// are `stride` apart, by elimination of the tridiagonal system
//
//   h_{i−1} M_{i−1} + 2 (h_{i−1} + h_i) M_i + h_i M_{i+1}
//     = 6 ((f_{i+1} − f_i)/h_i − (f_i − f_{i−1})/h_{i−1}),
//
// with M = 0 at both ends.
void NaturalCurvature(const std::vector<double>& grid, const double* values, size_t stride,
                      double* curvature) {
  const size_t last = grid.size() - 1;
  std::vector<double> upper(grid.size(), 0.0), right(grid.size(), 0.0);
  for (size_t i = 1; i < last; ++i) {
    const double before = grid[i] - grid[i - 1];
    const double after = grid[i + 1] - grid[i];
    const double bend = 6 * ((values[(i + 1) * stride] - values[i * stride]) / after -
                             (values[i * stride] - values[(i - 1) * stride]) / before);
    const double pivot = 2 * (before + after) - before * upper[i - 1];
    upper[i] = after / pivot;
    right[i] = (bend - before * right[i - 1]) / pivot;
  }
  curvature[last * stride] = 0;
  for (size_t i = last; i-- > 0;) {
    curvature[i * stride] = right[i] - upper[i] * curvature[(i + 1) * stride];
  }
}

// The grid cell of an argument, and the weights of the values (0, 1) and of the curvatures (2, 3)
// at the knots `cell` and cell + 1.
struct Place {
  size_t cell;
  std::array<double, 4> weight;
};

Place Find(const std::vector<double>& grid, double x, bool spline, int order) {
  const bool outside = x < grid.front() || x > grid.back();
  x = std::clamp(x, grid.front(), grid.back());
  const auto above = std::upper_bound(grid.begin() + 1, grid.end() - 1, x);
  const auto cell = static_cast<size_t>(above - grid.begin()) - 1;
  const double h = grid[cell + 1] - grid[cell];
  const double a = (grid[cell + 1] - x) / h;
  const double b = (x - grid[cell]) / h;
  if (order == 1) {
    if (outside) return {cell, {0, 0, 0, 0}};
    if (!spline) return {cell, {-1 / h, 1 / h, 0, 0}};
    // Derivative of the spline's weights below, with da/dx = −1/h and db/dx = 1/h.
    return {cell, {-1 / h, 1 / h, (1 - 3 * a * a) * h / 6, (3 * b * b - 1) * h / 6}};
  }
  if (!spline) return {cell, {a, b, 0, 0}};
  // (a³ − a) h²/6
  return {cell, {a, b, (a * a - 1) * a * h * h / 6, (b * b - 1) * b * h * h / 6}};
}

}  // namespace

absl::Status CheckTable(const LookupTable& table) {
  POLYEST_RETURN_IF_ERROR(CheckGrid("x", table.x));
  if (!table.y.empty()) POLYEST_RETURN_IF_ERROR(CheckGrid("y", table.y));
  const size_t columns = table.y.empty() ? 1 : table.y.size();
  if (table.value.size() != table.x.size() * columns) {
    return InvalidField(
        "value", absl::StrCat("has ", table.value.size(), " values; ", table.x.size(),
                              table.y.empty() ? "" : absl::StrCat(" × ", columns),
                              " are needed, one for each ",
                              table.y.empty() ? "x" : "pair of x and y, all of the first x first"));
  }
  for (size_t i = 0; i < table.value.size(); ++i) {
    if (!std::isfinite(table.value[i])) {
      return InvalidField({"value", i}, absl::StrCat("is ", table.value[i], "; it must be finite"));
    }
  }
  return absl::OkStatus();
}

Lookup::Lookup(LookupTable table) : table_(std::move(table)) {
  POLYEST_CHECK(CheckTable(table_).ok());
  if (!table_.spline) return;
  const size_t rows = table_.x.size();
  const size_t columns = two_dimensional() ? table_.y.size() : 1;
  curvature_x_.resize(rows * columns);
  for (size_t j = 0; j < columns; ++j) {
    NaturalCurvature(table_.x, table_.value.data() + j, columns, curvature_x_.data() + j);
  }
  if (!two_dimensional()) return;
  curvature_y_.resize(rows * columns);
  curvature_xy_.resize(rows * columns);
  for (size_t i = 0; i < rows; ++i) {
    const size_t row = i * columns;
    NaturalCurvature(table_.y, table_.value.data() + row, 1, curvature_y_.data() + row);
    NaturalCurvature(table_.y, curvature_x_.data() + row, 1, curvature_xy_.data() + row);
  }
}

double Lookup::Evaluate(double x, double y, int order_x, int order_y) const {
  if (std::isnan(x) || (two_dimensional() && std::isnan(y))) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const Place px = Find(table_.x, x, table_.spline, order_x);
  if (!two_dimensional()) {
    double sum = px.weight[0] * table_.value[px.cell] + px.weight[1] * table_.value[px.cell + 1];
    if (table_.spline) {
      sum += px.weight[2] * curvature_x_[px.cell] + px.weight[3] * curvature_x_[px.cell + 1];
    }
    return sum;
  }
  const Place py = Find(table_.y, y, table_.spline, order_y);
  double sum = 0;
  for (size_t i = 0; i < 2; ++i) {
    for (size_t j = 0; j < 2; ++j) {
      const size_t knot = (px.cell + i) * table_.y.size() + py.cell + j;
      sum += px.weight[i] * py.weight[j] * table_.value[knot];
      if (!table_.spline) continue;
      sum += px.weight[i + 2] * py.weight[j] * curvature_x_[knot] +
             px.weight[i] * py.weight[j + 2] * curvature_y_[knot] +
             px.weight[i + 2] * py.weight[j + 2] * curvature_xy_[knot];
    }
  }
  return sum;
}

}  // namespace polyest::internal::equations
