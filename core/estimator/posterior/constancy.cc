#include "core/estimator/posterior/constancy.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/bayes/chi_squared.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr size_t kMaxWindows = 32;
constexpr int64_t kMinRows = 8;  // of a window
// Normal deviate from which a test is significant, with tail 3·10⁻⁷ for one of up to some hundred.
constexpr double kSignificant = 5;
// A window counts if it has this share of the information of the best one.
constexpr double kMinShareOfInformation = 1e-3;
// The data must say at least as much about the parameter as its prior.
constexpr double kMinInformation = 1;

// Returns the matrix without row and column i.
Matrix Without(const Matrix& matrix, Eigen::Index i) {
  const Eigen::Index n = matrix.rows() - 1, m = n - i;
  Matrix rest(n, n);
  rest << matrix.topLeftCorner(i, i), matrix.topRightCorner(i, m),  //
      matrix.bottomLeftCorner(m, i), matrix.bottomRightCorner(m, m);
  return rest;
}

Vector Without(const Vector& vector, Eigen::Index i) {
  Vector rest(vector.size() - 1);
  rest << vector.head(i), vector.tail(vector.size() - 1 - i);
  return rest;
}

// The fall of the cost when parameter i may change from window to window.
struct Fit {
  double fall = 0;              // F_i; < 0 if it cannot be computed
  std::vector<double> changes;  // δ_w
};

// What holds the other parameters besides the windows that tell of parameter i: the prior, and the
// windows that tell nothing of it.
struct Rest {
  Vector gradient;
  Matrix curvature;
};

// Returns the fall of the cost, and how the parameter then changes.
Fit FitChanges(const std::vector<WindowScore>& windows, Eigen::Index i, const Rest& rest) {
  Matrix m = Without(rest.curvature, i);
  Vector v = Without(rest.gradient, i);
  Fit fit;
  for (const WindowScore& window : windows) {
    const double own = window.information(i, i);
    const Vector column = Without(Vector(window.information.col(i)), i);
    m += Without(window.information, i) - column * column.transpose() / own;
    v += Without(window.score, i) - column * (window.score[i] / own);
    fit.fall += window.score[i] * window.score[i] / own;
  }
  Vector others = Vector::Zero(m.rows());  // the change of the other parameters
  if (m.rows() > 0) {
    const CholeskyFactor factor((m + m.transpose()) / 2);
    if (!factor.positive_definite()) return {-1, {}};
    others = -factor.Solve(v);
    fit.fall -= v.dot(others);
  }
  for (const WindowScore& window : windows) {
    const Vector column = Without(Vector(window.information.col(i)), i);
    fit.changes.push_back(-(window.score[i] + column.dot(others)) / window.information(i, i));
  }
  return fit;
}

struct Test {
  double deviate = 0;
  std::vector<WindowChange> changes;
};

// Tests parameter i with windows of one length.
Test TestParameter(const std::vector<WindowScore>& windows, Eigen::Index i, Rest rest,
                   double dispersion) {
  double largest = 0, sum = 0;
  for (const WindowScore& window : windows) {
    largest = std::max(largest, window.information(i, i));
    sum += window.information(i, i);
  }
  if (!(sum >= kMinInformation)) return {};
  std::vector<WindowScore> informed;
  for (const WindowScore& window : windows) {
    if (window.information(i, i) > kMinShareOfInformation * largest) {
      informed.push_back(window);
    } else {
      rest.gradient += window.score;
      rest.curvature += window.information;
    }
  }
  if (informed.size() < 2) return {};
  const Fit constant = FitChanges({SumOf(informed)}, i, rest);
  const Fit changing = FitChanges(informed, i, rest);
  const double t = (changing.fall - constant.fall) / dispersion;
  if (constant.fall < 0 || changing.fall < 0 || !(t > 0) || !std::isfinite(t)) return {};
  Test test;
  test.deviate = NormalDeviateOfChiSquared(t, static_cast<double>(informed.size() - 1));
  for (size_t w = 0; w < informed.size(); ++w) {
    test.changes.push_back({informed[w].span, changing.changes[w],
                            std::sqrt(dispersion / informed[w].information(i, i))});
  }
  return test;
}

Inconsistency Describe(int parameter, const std::vector<WindowChange>& changes) {
  Inconsistency result;
  result.parameter = parameter;
  for (size_t a = 0; a < changes.size(); ++a) {
    for (size_t b = a + 1; b < changes.size(); ++b) {
      const double separation = std::abs(changes[a].change - changes[b].change) /
                                std::hypot(changes[a].std_dev, changes[b].std_dev);
      if (separation <= result.separation) continue;
      result.separation = separation;
      result.first = changes[a];
      result.second = changes[b];
    }
  }
  return result;
}

}  // namespace

std::optional<Inconsistency> FindInconsistency(std::vector<WindowScore> windows,
                                               const Matrix& precision,
                                               const Vector& prior_gradient, double dispersion) {
  Test best;
  best.deviate = kSignificant;
  int parameter = -1;
  while (windows.size() > kMaxWindows || (windows.size() > 1 && windows[0].span.rows < kMinRows)) {
    windows = MergePairs(windows);
  }
  for (; windows.size() > 1; windows = MergePairs(windows)) {
    for (Eigen::Index i = 0; i < precision.rows(); ++i) {
      Test test = TestParameter(windows, i, {prior_gradient, precision}, dispersion);
      if (test.deviate <= best.deviate) continue;
      best = std::move(test);
      parameter = static_cast<int>(i);
    }
  }
  if (parameter < 0) return std::nullopt;
  return Describe(parameter, best.changes);
}

}  // namespace polyest::internal
