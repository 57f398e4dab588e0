#include "core/estimator/studies/log_density.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/chaos/germ.h"
#include "core/common/field_error.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Slack of the box in which an expansion is trusted, for points on its very edge that rounding
// moves, in its own coordinates, which are of the order of 1.
constexpr double kBoxSlack = 1e-9;

// The map of one parameter, θ = t(z), at a score: t′, and of log t′ the value and derivatives.
struct Stretch {
  double slope = 0;
  double log = 0;
  double first = 0;
  double second = 0;
};

// Computes the stretch of θ = T(x(z)), T affine or exponential in the parameter's own germ x:
//   log t′ = log T′(x) + log x′(z),   (log T′)′ = the scale of an exponential map, else 0;
//   x = z, unless the parameter is correlated. Then x is of the same probability as the normal
//   score z, so that log x′ = log φ(z) − log ρ(x), (log x′)′ = −z − (log ρ)′(x) x′ and so on.
Stretch StretchOf(const Prior& prior, int i, double z) {
  const UncertainParameter& parameter = prior.parameters()[static_cast<size_t>(i)];
  const Germ own(parameter.germ);
  const double x = prior.MarginalGerm(i, z);
  double x1 = 1, log_x1 = 0, first = 0, second = 0;
  if (own.family() != GermFamily::kNormal &&
      prior.germs()[static_cast<size_t>(i)].family() == GermFamily::kNormal) {
    log_x1 = Germ::Normal().LogDensity(z) - own.LogDensity(x);
    x1 = std::exp(log_x1);
    const double slope = own.LogDensityDerivative(x);
    first = -z - slope * x1;
    second = -1 - own.LogDensitySecondDerivative(x) * x1 * x1 - slope * x1 * first;
  }
  const double rate = parameter.map == ParameterMap::kExponential ? parameter.scale : 0;
  return {.slope = parameter.Slope(x) * x1,
          .log = std::log(parameter.Slope(x)) + log_x1,
          .first = rate * x1 + first,
          .second = rate * x1 * first + second};
}

// A function of the scores z at one point.
struct InScores {
  double value;
  Vector gradient;
  Matrix hessian;
};

// Returns −f as a function of θ, with t″ = t′ (log t′)′:
//   ∂f/∂θ_i = f_i/t_i′,   ∂²f/∂θ_i∂θ_j = f_ij/(t_i′ t_j′) − δ_ij f_i (log t_i′)′/t_i′².
LogDensityValue NegativeInParameters(const InScores& f, const std::vector<Stretch>& stretch,
                                     int derivative_order) {
  LogDensityValue density{.value = -f.value, .gradient = {}, .hessian = {}};
  const auto n = static_cast<Eigen::Index>(stretch.size());
  Vector inverse(n), bend(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Stretch& one = stretch[static_cast<size_t>(i)];
    inverse[i] = 1 / one.slope;
    bend[i] = one.first;
  }
  if (derivative_order > 0) density.gradient = -f.gradient.cwiseProduct(inverse);
  if (derivative_order > 1) {
    density.hessian = -(inverse.asDiagonal() * f.hessian * inverse.asDiagonal());
    density.hessian.diagonal() +=
        f.gradient.cwiseProduct(bend).cwiseProduct(inverse).cwiseProduct(inverse);
  }
  return density;
}

// Evaluates one component at the germs ξ of a point.
class PointOfComponent {
 public:
  PointOfComponent(const TrustedCost& component, const Vector& xi)
      : cost_(component.cost), xi_(xi), eta_(cost_.region().ToLocal(xi)) {
    const bool trusted = (eta_.array() >= component.lower.array() - kBoxSlack).all() &&
                         (eta_.array() <= component.upper.array() + kBoxSlack).all();
    if (!trusted) return;
    value_ = cost_.Evaluate(eta_);
    total_ = value_.total + component.height;
  }

  // The cost, comparable among components; +∞ where the component has none.
  double total() const { return total_; }

  // Writes both densities, whose constants are those of the cost without `height`.
  void Describe(int derivative_order, double height, LogDensityValue& posterior,
                LogDensityValue& likelihood) const {
    const Prior& prior = cost_.prior();
    const Vector z = prior.ToScores(xi_);
    std::vector<Stretch> stretch;
    for (int i = 0; i < prior.dimension(); ++i) stretch.push_back(StretchOf(prior, i, z[i]));
    InScores whole{total_ - height, {}, {}};
    const double alpha2 = cost_.regularization();
    InScores data{whole.value - alpha2 * value_.prior, {}, {}};
    if (derivative_order > 0) Differentiate(derivative_order, whole, data);
    for (int i = 0; i < prior.dimension(); ++i) {
      const Stretch& one = stretch[static_cast<size_t>(i)];
      whole.value += one.log;
      if (derivative_order > 0) whole.gradient[i] += one.first;
      if (derivative_order > 1) whole.hessian(i, i) += one.second;
    }
    posterior = NegativeInParameters(whole, stretch, derivative_order);
    likelihood = NegativeInParameters(data, stretch, derivative_order);
  }

 private:
  // Sets the derivatives with respect to the scores z = F (centre + axes η), ξ = F⁻¹ z.
  void Differentiate(int derivative_order, InScores& whole, InScores& data) const {
    const Prior& prior = cost_.prior();
    const double alpha2 = cost_.regularization();
    const Matrix to_eta = Inverse(prior.factor() * cost_.region().axes());
    const Matrix to_xi = Inverse(prior.factor());
    Vector gradient(eta_.size());
    cost_.EvaluateWithGradient(eta_, gradient);
    whole.gradient = to_eta.transpose() * gradient;
    data.gradient = whole.gradient - alpha2 * (to_xi.transpose() * prior.Gradient(xi_));
    if (derivative_order < 2) return;
    whole.hessian = to_eta.transpose() * cost_.Hessian(eta_) * to_eta;
    data.hessian =
        whole.hessian - alpha2 * (to_xi.transpose() * prior.Curvature(xi_).asDiagonal() * to_xi);
  }

  const Cost& cost_;
  const Vector& xi_;
  const Vector eta_;
  CostValue value_;
  double total_ = std::numeric_limits<double>::infinity();
};

absl::Status NoValue(Eigen::Index point, const std::vector<std::string>& names, const Vector& theta,
                     absl::string_view why) {
  std::vector<std::string> values;
  for (size_t i = 0; i < names.size(); ++i) {
    values.push_back(absl::StrFormat("%s = %g", names[i], theta[static_cast<Eigen::Index>(i)]));
  }
  return InvalidField(FieldPath{"values"}, absl::StrFormat("point %d (%s) %s", point + 1,
                                                           absl::StrJoin(values, ", "), why));
}

// Returns ξ; nothing for a point that is not in the interior of the prior's support.
std::optional<Vector> GermsOf(const Prior& prior, const Vector& theta) {
  if (!theta.allFinite()) return std::nullopt;
  Vector xi = prior.ToGerm(theta);
  if (!prior.Contains(xi)) return std::nullopt;
  const Vector z = prior.ToScores(xi);
  for (int i = 0; i < prior.dimension(); ++i) {
    const Stretch stretch = StretchOf(prior, i, z[i]);
    if (!(stretch.slope > 0) || !std::isfinite(stretch.log) || !std::isfinite(stretch.second)) {
      return std::nullopt;
    }
  }
  return xi;
}

}  // namespace

absl::Status Validate(const LogDensityOptions& options, const std::vector<std::string>& names) {
  POLYEST_RETURN_IF_ERROR(CheckRange("derivative_order", options.derivative_order, 0, 2));
  const auto n = static_cast<Eigen::Index>(names.size());
  if (options.points.rows() == 0) return absl::OkStatus();
  if (options.points.cols() != n) {
    return InvalidField(
        "values", absl::StrFormat("points need %d values each: %s", n, absl::StrJoin(names, ", ")));
  }
  const double each = options.derivative_order == 0   ? 1.0
                      : options.derivative_order == 1 ? 1.0 + n
                                                      : 1.0 + n + n * n;
  if (2 * each * static_cast<double>(options.points.rows()) > kMaxLogDensityValues) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("values: %d points would give an answer of more than %d numbers",
                        options.points.rows(), kMaxLogDensityValues));
  }
  return absl::OkStatus();
}

absl::StatusOr<LogDensity> EvaluateLogDensity(const DensityBasis& basis,
                                              const LogDensityOptions& options) {
  const Prior& prior = basis.components.front().cost.prior();
  LogDensity result{prior.Names(), basis.units, {}, {}, basis.diagnostics};
  for (Eigen::Index row = 0; row < options.points.rows(); ++row) {
    const Vector theta = options.points.row(row).transpose();
    const std::optional<Vector> xi = GermsOf(prior, theta);
    if (!xi) return NoValue(row, result.parameters, theta, "lies outside of the prior's support");
    std::optional<PointOfComponent> lowest;
    for (const TrustedCost& component : basis.components) {
      const PointOfComponent point(component, *xi);
      if (std::isfinite(point.total()) && (!lowest || point.total() < lowest->total())) {
        lowest.emplace(point);
      }
    }
    if (!lowest) {
      return NoValue(row, result.parameters, theta,
                     "is too far from the posterior: the expansion is not trusted there");
    }
    lowest->Describe(options.derivative_order, basis.components.front().height,
                     result.posterior.emplace_back(), result.likelihood.emplace_back());
  }
  return result;
}

}  // namespace polyest::internal
