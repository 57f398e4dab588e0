#include "core/bayes/regularization.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/bayes/regularization_prior.h"
#include "core/chaos/normal.h"
#include "core/common/check.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr double kLowest = 1e-4, kHighest = 1e4;
constexpr int kValues = 33;
constexpr double kPrecision = 1e-4;  // of log α²
// The least fall of the evidence towards either end of the range.
constexpr double kMinFall = 0.5;

RegularizationChoice Undetermined(std::string reason) { return {false, 1, std::move(reason)}; }

RegularizationChoice Determined(double regularization) { return {true, regularization, ""}; }

// Returns 2 J_mismatch − (N − γ), the mismatch beyond what the noise allows.
double Discrepancy(const RegularizedMinimum& minimum, double degrees) {
  return 2 * minimum.cost.mismatch - (degrees - minimum.effective_parameters);
}

// Returns the point of the only maximum of a function in [lower, upper], by golden section.
double Maximize(const std::function<double(double)>& function, double lower, double upper) {
  const double section = 1 / std::numbers::phi;
  double left = upper - section * (upper - lower), right = lower + section * (upper - lower);
  double at_left = function(left), at_right = function(right);
  while (upper - lower > kPrecision) {
    if (at_left >= at_right) {
      upper = std::exchange(right, left);
      at_right = at_left;
      at_left = function(left = upper - section * (upper - lower));
    } else {
      lower = std::exchange(left, right);
      at_left = at_right;
      at_right = function(right = lower + section * (upper - lower));
    }
  }
  return 0.5 * (lower + upper);
}

// Returns Laplace's log p(z | α²) without −J: −log Z + (n/2) log 2π − ½ log det H, with H's
// eigenvalues in units of the deviations of the prior of weight α², and the share of each parameter
// that the data fit.
double LogVolume(const Cost& cost, const Vector& deviation, const Vector& curvature,
                 const Vector& fitted) {
  double sum = 0;
  for (int i = 0; i < cost.dimension(); ++i) {
    const Germ& germ = cost.prior().germs()[static_cast<size_t>(i)];
    const double log_z = fitted[i] * LogNormalization(germ, cost.regularization()) +
                         (1 - fitted[i]) * LogLaplaceNormalization(germ, cost.regularization());
    sum += 0.5 * (kLogTwoPi - std::log(curvature[i])) + std::log(deviation[i]) - log_z;
  }
  return sum;
}

}  // namespace

std::optional<RegularizedMinimum> DescribeMinimum(const Cost& cost, const ConstVectorRef& eta) {
  POLYEST_CHECK(cost.regularization() > 0);
  const double alpha_squared = cost.regularization();
  const std::vector<Germ>& germs = cost.prior().germs();
  const int n = cost.dimension();
  Vector deviation(n);  // of the prior of weight α²
  for (int i = 0; i < n; ++i) {
    deviation[i] = std::sqrt(WeightedVariance(germs[static_cast<size_t>(i)], alpha_squared));
  }
  const Matrix unscale = Inverse(cost.region().axes()) * deviation.asDiagonal();
  const Matrix mismatch = unscale.transpose() * cost.MismatchHessian(eta) * unscale;
  const Matrix total = unscale.transpose() * cost.Hessian(eta) * unscale;
  RegularizedMinimum minimum;
  minimum.regularization = alpha_squared;
  minimum.point = eta;
  minimum.cost = cost.Evaluate(eta);
  if (!total.allFinite() || !std::isfinite(minimum.cost.total)) return std::nullopt;
  // γ_i = Σ_k V_ik² λ_k/(1 + λ_k)
  const SymmetricEigen data = DecomposeSymmetric(mismatch);
  const Vector information = data.values.cwiseMax(0);
  const Vector fitted =
      data.vectors.cwiseAbs2() * information.cwiseQuotient((information.array() + 1).matrix());
  minimum.effective_parameters = fitted.sum();
  const Vector curvature = SymmetricEigenvalues(total).cwiseMax(1);
  minimum.log_evidence = -minimum.cost.total + LogVolume(cost, deviation, curvature, fitted);
  return minimum;
}

std::vector<RegularizedMinimum> SweepRegularization(const Vector& values,
                                                    const MinimumAt& minimum) {
  std::vector<RegularizedMinimum> points;
  for (Eigen::Index i = values.size() - 1; i >= 0; --i) {
    if (auto point = minimum(values[i])) points.push_back(*std::move(point));
  }
  std::reverse(points.begin(), points.end());
  return points;
}

Vector LogarithmicRange(double lowest, double highest, int count) {
  POLYEST_CHECK(0 < lowest && lowest <= highest && count >= 1);
  Vector values = Vector::LinSpaced(count, std::log10(lowest), std::log10(highest));
  for (double& value : values) value = std::pow(10.0, value);
  return values;
}

Vector RangeOfChoice() { return LogarithmicRange(kLowest, kHighest, kValues); }

RegularizationChoice ChooseByDiscrepancy(const std::vector<RegularizedMinimum>& points,
                                         const MinimumAt& minimum, double degrees) {
  if (points.empty()) return Undetermined("the cost has no minimum to be trusted for any α²");
  size_t last = points.size();  // the largest α² that the noise explains, and 1
  while (last > 0 && Discrepancy(points[last - 1], degrees) > 0) --last;
  if (last == 0) {
    return Undetermined(absl::StrFormat(
        "the mismatch is larger than the noise explains even with α² = %.3g (χ² = %.4g, %.4g "
        "degrees of freedom)",
        points.front().regularization, 2 * points.front().cost.mismatch,
        degrees - points.front().effective_parameters));
  }
  if (last == points.size()) {
    return Undetermined(
        absl::StrFormat("the noise explains the mismatch up to α² = %.3g, the "
                        "largest that could be tried",
                        points.back().regularization));
  }
  double lower = std::log(points[last - 1].regularization);
  double upper = std::log(points[last].regularization);
  while (upper - lower > kPrecision) {
    const double middle = 0.5 * (lower + upper);
    const auto point = minimum(std::exp(middle));
    (point && Discrepancy(*point, degrees) <= 0 ? lower : upper) = middle;
  }
  return Determined(std::exp(lower));
}

RegularizationChoice ChooseByEvidence(const std::vector<RegularizedMinimum>& points,
                                      const MinimumAt& minimum) {
  if (points.empty()) return Undetermined("the cost has no minimum to be trusted for any α²");
  const auto less = [](const RegularizedMinimum& a, const RegularizedMinimum& b) {
    return a.log_evidence < b.log_evidence;
  };
  const auto best = std::max_element(points.begin(), points.end(), less);
  const double ends = std::max(points.front().log_evidence, points.back().log_evidence);
  if (!(best->log_evidence - ends >= kMinFall)) {
    return Undetermined(absl::StrFormat(
        "the data are about as probable with α² = %.3g as with any other (its log evidence is "
        "%.3g below the greatest)",
        (points.front().log_evidence > points.back().log_evidence ? points.front() : points.back())
            .regularization,
        best->log_evidence - ends));
  }
  const auto evidence = [&](double tau) {
    const auto point = minimum(std::exp(tau));
    return point ? point->log_evidence : -std::numeric_limits<double>::infinity();
  };
  return Determined(std::exp(Maximize(evidence, std::log(std::prev(best)->regularization),
                                      std::log(std::next(best)->regularization))));
}

}  // namespace polyest::internal
