#include "core/chaos/truncated_normal.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/SpecialFunctions>

#include "core/chaos/gauss_rule.h"
#include "core/chaos/stieltjes.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

// The limit beyond which the density underflows: e^{−38²/2} ≈ 10⁻³¹⁴.
constexpr double kReach = 38;
constexpr double kPanel = 1;
constexpr int kNodesForNormalDensity = 20;
constexpr int kMaxSteps = 200;
constexpr double kConverged = 1e-9;  // the error left by Newton's method is its square

double Density(double x) {
  return std::exp(-0.5 * x * x) * (0.5 * std::numbers::sqrt2 * std::numbers::inv_sqrtpi);
}

// Returns ∫_a^b φ by Gauss–Legendre quadrature; requires b − a ≤ kPanel.
double PanelProbability(double a, double b) {
  static const GaussRule rule = MakeGaussRule(Germ::Uniform(), kNodesForNormalDensity);
  const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
  double sum = 0;
  for (Eigen::Index i = 0; i < rule.nodes.size(); ++i) {
    sum += rule.weights[i] * Density(middle + half * rule.nodes[i]);
  }
  return (b - a) * sum;
}

DiscreteMeasure Discretize(double a, double b, int nodes) {
  const GaussRule rule = MakeGaussRule(Germ::Uniform(), nodes);
  const double mode = std::clamp(0.0, a, b);
  const double start = std::max(a, mode - kReach);
  const double length = std::min(b, mode + kReach) - start;
  const int panels = static_cast<int>(std::ceil(length / kPanel));
  const double width = length / panels;
  DiscreteMeasure result{start, Eigen::ArrayXd(panels * nodes), Eigen::ArrayXd(panels * nodes)};
  for (int panel = 0; panel < panels; ++panel) {
    const Eigen::ArrayXd offset = width * (panel + 0.5 * (1 + rule.nodes.array()));
    result.offsets.segment(panel * nodes, nodes) = offset;
    // φ(x)/φ(mode), x = start + offset: (x² − mode²)/2 = (x − mode)(x + mode)/2
    result.weights.segment(panel * nodes, nodes) =
        rule.weights.array() * (-0.5 * ((start - mode) + offset) * ((start + mode) + offset)).exp();
  }
  result.weights /= result.weights.sum();
  return result;
}

}  // namespace

double NormalProbability(double a, double b) {
  if (!(a < b)) return 0;
  if (b - a <= kPanel) return PanelProbability(a, b);
  const double lower = a / std::numbers::sqrt2, upper = b / std::numbers::sqrt2;
  // The result is a difference within one tail, which does not cancel, or a sum across the middle.
  if (a > 0) return 0.5 * (std::erfc(lower) - std::erfc(upper));
  if (b < 0) return 0.5 * (std::erfc(-upper) - std::erfc(-lower));
  return 0.5 * (std::erf(upper) - std::erf(lower));
}

// Applies Newton's method to log ∫_a^ξ φ − log(p Z), an increasing concave function: from a start
// that is not above the root every iterate stays below it.
double TruncatedNormalQuantile(double a, double b, double p) {
  POLYEST_CHECK(a < b && p > 0 && p <= 0.5);
  const double target = p * NormalProbability(a, b);
  // ∫_a^ξ φ is at most Φ(ξ), and at most φ(0) (ξ − a).
  double xi = std::max(Eigen::numext::ndtri(target), a + target / Density(0));
  for (int step = 0; step < kMaxSteps; ++step) {
    const double probability = NormalProbability(a, xi);
    if (!(probability > 0)) break;  // ξ is a, to rounding
    const double slope = Density(xi) / probability;
    const double change = std::log(target / probability) / slope;
    xi = std::min(xi + change, b);
    if (std::abs(change) <= kConverged * std::min(1.0, 1 / slope)) break;
  }
  return xi;
}

RecurrenceCoefficients TruncatedNormalRecurrence(double a, double b, int count) {
  POLYEST_CHECK(a < b && count >= 1 && count <= Germ::kMaxTruncatedNormalOrder + 1);
  return StieltjesRecurrence(Discretize(a, b, count + kNodesForNormalDensity), count);
}

}  // namespace polyest::internal
