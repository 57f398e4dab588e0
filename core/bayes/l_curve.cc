#include "core/bayes/l_curve.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

// The part of its largest value below which a term is rounding error.
constexpr double kResolved = 1e-10;
// The shortest leg of the L, a doubling.
const double kMinLeg = std::log(2.0);

// A point of the curve in logarithms; both coordinates are functions of τ = log α².
struct LogPoint {
  size_t index;
  double tau;
  double mismatch;  // log J_mismatch
  double prior;     // log (J_apriori − min J_apriori)
};

double PriorAtModes(const Prior& prior) {
  Vector modes(prior.dimension());
  for (int i = 0; i < prior.dimension(); ++i)
    modes[i] = prior.germs()[static_cast<size_t>(i)].Mode();
  return prior.NegativeLogDensity(modes);
}

std::vector<LogPoint> ResolvedPoints(const std::vector<RegularizedMinimum>& points,
                                     double min_prior) {
  double largest_mismatch = 0;
  double largest_prior = 0;
  for (const RegularizedMinimum& point : points) {
    if (!std::isfinite(point.cost.mismatch) || !std::isfinite(point.cost.prior)) continue;
    largest_mismatch = std::max(largest_mismatch, point.cost.mismatch);
    largest_prior = std::max(largest_prior, point.cost.prior - min_prior);
  }
  std::vector<LogPoint> resolved;
  for (size_t i = 0; i < points.size(); ++i) {
    const CostValue& cost = points[i].cost;
    const double prior = cost.prior - min_prior;
    if (!std::isfinite(cost.mismatch) || !std::isfinite(prior)) continue;
    if (!(cost.mismatch > kResolved * largest_mismatch)) continue;
    if (!(prior > kResolved * largest_prior)) continue;
    resolved.push_back(
        {i, std::log(points[i].regularization), std::log(cost.mismatch), std::log(prior)});
  }
  return resolved;
}

// Returns the curvature at b of the curve through three points, positive where an L bends:
//   κ = (x′ y″ − x″ y′)/(x′² + y′²)^{3/2},  x = log J_mismatch, y = log prior term, ′ = d/dτ.
double BendAt(const LogPoint& a, const LogPoint& b, const LogPoint& c) {
  const double left = b.tau - a.tau;
  const double right = c.tau - b.tau;
  const auto first = [&](double at_a, double at_b, double at_c) {
    return ((at_b - at_a) / left * right + (at_c - at_b) / right * left) / (left + right);
  };
  const auto second = [&](double at_a, double at_b, double at_c) {
    return 2 * ((at_c - at_b) / right - (at_b - at_a) / left) / (left + right);
  };
  const double x1 = first(a.mismatch, b.mismatch, c.mismatch);
  const double y1 = first(a.prior, b.prior, c.prior);
  const double x2 = second(a.mismatch, b.mismatch, c.mismatch);
  const double y2 = second(a.prior, b.prior, c.prior);
  const double speed = std::hypot(x1, y1);
  return speed > 0 ? (x1 * y2 - x2 * y1) / (speed * speed * speed) : 0;
}

}  // namespace

RegularizationChoice ChooseByLCurve(const std::vector<RegularizedMinimum>& minima,
                                    const Prior& prior) {
  const std::vector<LogPoint> points = ResolvedPoints(minima, PriorAtModes(prior));
  RegularizationChoice choice;
  double sharpest = 0;
  for (size_t i = 1; i + 1 < points.size(); ++i) {
    const double upright = points.front().prior - points[i].prior;
    const double lying = points.back().mismatch - points[i].mismatch;
    if (upright < kMinLeg || lying < kMinLeg) continue;
    const double bend = BendAt(points[i - 1], points[i], points[i + 1]);
    if (!(bend > sharpest)) continue;
    sharpest = bend;
    choice = {true, minima[points[i].index].regularization, ""};
  }
  if (!choice.determined) {
    choice.reason =
        "the L-curve has no corner: no α² below which the prior term, and above which "
        "the mismatch, doubles";
  }
  return choice;
}

}  // namespace polyest::internal
