#include "client/plot/contours.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

using EdgeId = Eigen::Index;
constexpr EdgeId kNoEdge = -1;

// Collects the segments of all cells and then joins them where they share an edge of the grid.
class Tracer {
 public:
  Tracer(const Vector& x, const Vector& y, const Matrix& value, double level)
      : x_(x), y_(y), value_(value), level_(level) {}

  std::vector<ContourLine> Trace() {
    for (Eigen::Index i = 0; i + 1 < x_.size(); ++i) {
      for (Eigen::Index j = 0; j + 1 < y_.size(); ++j) AddCell(i, j);
    }
    std::vector<ContourLine> lines;
    // Open lines start at an edge with one neighbour; the remaining lines are closed.
    for (const auto& [edge, neighbours] : neighbours_) {
      if (neighbours[1] == kNoEdge && !visited_[edge]) lines.push_back(Follow(edge));
    }
    for (const auto& [edge, neighbours] : neighbours_) {
      if (visited_[edge]) continue;
      lines.push_back(Follow(edge));
      lines.back().closed = true;
    }
    return lines;
  }

 private:
  bool Above(Eigen::Index i, Eigen::Index j) const { return value_(i, j) > level_; }

  // Number an edge by its lower corner: edges along x have even numbers, edges along y odd ones.
  EdgeId AlongX(Eigen::Index i, Eigen::Index j) const { return 2 * (i * y_.size() + j); }
  EdgeId AlongY(Eigen::Index i, Eigen::Index j) const { return AlongX(i, j) + 1; }

  void AddCell(Eigen::Index i, Eigen::Index j) {
    if (!value_.block<2, 2>(i, j).allFinite()) return;
    const EdgeId bottom = AlongX(i, j), top = AlongX(i, j + 1);
    const EdgeId left = AlongY(i, j), right = AlongY(i + 1, j);
    const bool corner[4] = {Above(i, j), Above(i + 1, j), Above(i + 1, j + 1), Above(i, j + 1)};
    const EdgeId edge[4] = {bottom, right, top, left};  // between corner e and the next
    EdgeId crossed[4];
    int count = 0;
    for (int e = 0; e < 4; ++e) {
      if (corner[e] != corner[(e + 1) % 4]) crossed[count++] = edge[e];
    }
    if (count == 2) Join(crossed[0], crossed[1]);
    if (count != 4) return;
    const bool centre = value_.block<2, 2>(i, j).mean() > level_;
    if (centre == corner[0]) {  // the first corner and its opposite are joined through the centre
      Join(bottom, right);
      Join(top, left);
    } else {
      Join(left, bottom);
      Join(right, top);
    }
  }

  void Join(EdgeId a, EdgeId b) {
    Link(a, b);
    Link(b, a);
  }

  void Link(EdgeId from, EdgeId to) {
    auto [position, inserted] = neighbours_.try_emplace(from, std::array{to, kNoEdge});
    if (!inserted) position->second[1] = to;
  }

  std::array<double, 2> Crossing(EdgeId edge) const {
    const Eigen::Index i = edge / 2 / y_.size(), j = edge / 2 % y_.size();
    const bool along_x = edge % 2 == 0;
    const double low = value_(i, j), high = along_x ? value_(i + 1, j) : value_(i, j + 1);
    const double part = (level_ - low) / (high - low);
    if (along_x) return {x_(i) + part * (x_(i + 1) - x_(i)), y_(j)};
    return {x_(i), y_(j) + part * (y_(j + 1) - y_(j))};
  }

  ContourLine Follow(EdgeId edge) {
    ContourLine line;
    while (edge != kNoEdge) {
      visited_[edge] = true;
      line.points.push_back(Crossing(edge));
      EdgeId next = kNoEdge;
      for (EdgeId neighbour : neighbours_.at(edge)) {
        if (neighbour != kNoEdge && !visited_[neighbour]) {
          next = neighbour;
          break;
        }
      }
      edge = next;
    }
    return line;
  }

  const Vector& x_;
  const Vector& y_;
  const Matrix& value_;
  double level_;
  std::map<EdgeId, std::array<EdgeId, 2>> neighbours_;
  std::map<EdgeId, bool> visited_;
};

// Interpolates the rows of `value`, at x, at part/parts of each cell of x.
Matrix RefinedRows(const Vector& x, const Matrix& value, Eigen::Index parts) {
  const Eigen::Index cells = x.size() - 1;
  Matrix fine(cells * parts + 1, value.cols());
  for (Eigen::Index i = 0; i < cells; ++i) {
    // The slopes at the ends of the cell; at the grid's border that of the parabola through the
    // next three rows.
    const auto slope = [&](Eigen::Index k) -> Eigen::RowVectorXd {
      if (x.size() < 3) return (value.row(1) - value.row(0)) / (x[1] - x[0]);
      const Eigen::Index m = std::clamp<Eigen::Index>(k, 1, cells - 1);
      const double left = x[m] - x[m - 1], right = x[m + 1] - x[m];
      const Eigen::RowVectorXd before = (value.row(m) - value.row(m - 1)) / left;
      const Eigen::RowVectorXd after = (value.row(m + 1) - value.row(m)) / right;
      if (k < m) return before - (after - before) * (left / (left + right));
      if (k > m) return after + (after - before) * (right / (left + right));
      return (before * right + after * left) / (left + right);
    };
    const double h = x[i + 1] - x[i];
    const Eigen::RowVectorXd first = h * slope(i), last = h * slope(i + 1);
    for (Eigen::Index part = 0; part < parts; ++part) {
      const double u = static_cast<double>(part) / static_cast<double>(parts);
      const Eigen::RowVectorXd linear = (1 - u) * value.row(i) + u * value.row(i + 1);
      const Eigen::RowVectorXd rise = value.row(i + 1) - value.row(i);
      // Hermite's cubic with these slopes.
      const Eigen::RowVectorXd cubic =
          linear + u * (1 - u) * ((1 - u) * (first - rise) - u * (last - rise));
      fine.row(i * parts + part) = cubic.array().isFinite().select(cubic, linear);
    }
  }
  fine.row(cells * parts) = value.row(cells);
  return fine;
}

Vector RefinedAxis(const Vector& x, Eigen::Index parts) {
  Vector fine((x.size() - 1) * parts + 1);
  for (Eigen::Index k = 0; k < fine.size() - 1; ++k) {
    const Eigen::Index i = k / parts;
    fine[k] =
        x[i] + (x[i + 1] - x[i]) * static_cast<double>(k % parts) / static_cast<double>(parts);
  }
  fine[fine.size() - 1] = x[x.size() - 1];
  return fine;
}

}  // namespace

ContourGrid RefinedGrid(const Vector& x, const Vector& y, const Matrix& value, Eigen::Index parts) {
  POLYEST_CHECK(parts >= 1 && x.size() >= 2 && y.size() >= 2);
  POLYEST_CHECK(value.rows() == x.size() && value.cols() == y.size());
  const Matrix along_x = RefinedRows(x, value, parts);
  return {RefinedAxis(x, parts), RefinedAxis(y, parts),
          RefinedRows(y, along_x.transpose(), parts).transpose()};
}

std::vector<ContourLine> ContourLines(const Vector& x, const Vector& y, const Matrix& value,
                                      double level) {
  POLYEST_CHECK(value.rows() == x.size() && value.cols() == y.size());
  return Tracer(x, y, value, level).Trace();
}

std::vector<double> BowlLevels(const Matrix& value, int count) {
  double least = std::numeric_limits<double>::infinity(), largest = -least;
  for (double v : value.reshaped()) {
    if (!std::isfinite(v)) continue;
    least = std::min(least, v);
    largest = std::max(largest, v);
  }
  std::vector<double> levels;
  if (!(largest > least)) return levels;
  for (int i = 1; i <= count; ++i) {
    const double part = static_cast<double>(i) / (count + 1);
    levels.push_back(least + (largest - least) * part * part);
  }
  return levels;
}

}  // namespace polyest::internal
