#include "core/bayes/prior.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <limits>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest {
namespace {

// Squares of anything in between are still finite numbers.
constexpr double kLeastScale = 1e-100;
constexpr double kGreatestMagnitude = 1e100;
// Past it a beta or gamma density is a normal one to a percent.
constexpr double kGreatestShape = 10'000;

absl::Status Invalid(const std::string& name, const char* family, const std::string& rule) {
  return absl::InvalidArgumentError(absl::StrCat("uncertain ", name, ": ", family, ": ", rule));
}

absl::Status CheckName(const std::string& name) {
  if (name.empty()) return absl::InvalidArgumentError("uncertain: name must not be empty");
  return absl::OkStatus();
}

absl::Status CheckLocation(const std::string& name, const char* family, const char* field,
                           double value) {
  if (std::abs(value) <= kGreatestMagnitude) return absl::OkStatus();
  return Invalid(name, family,
                 absl::StrCat(field, " ", value, " must be finite and at most ", kGreatestMagnitude,
                              " in magnitude"));
}

absl::Status CheckScale(const std::string& name, const char* family, const char* field,
                        double value) {
  if (!(value > 0)) return Invalid(name, family, absl::StrCat(field, " ", value, " must be > 0"));
  if (value >= kLeastScale && value <= kGreatestMagnitude) return absl::OkStatus();
  return Invalid(name, family,
                 absl::StrCat(field, " ", value, " must lie between ", kLeastScale, " and ",
                              kGreatestMagnitude));
}

absl::Status CheckShape(const std::string& name, const char* family, const char* field,
                        double value) {
  if (value >= 1 && value <= kGreatestShape) return absl::OkStatus();
  return Invalid(name, family,
                 absl::StrCat(field, " ", value, " must lie between 1 and ", kGreatestShape));
}

absl::Status CheckBounds(const std::string& name, const char* family, double lower, double upper) {
  POLYEST_RETURN_IF_ERROR(CheckLocation(name, family, "lower", lower));
  POLYEST_RETURN_IF_ERROR(CheckLocation(name, family, "upper", upper));
  if (!(lower < upper)) {
    return Invalid(name, family, absl::StrCat("lower ", lower, " must be below upper ", upper));
  }
  return CheckScale(name, family, "upper - lower", upper - lower);
}

}  // namespace

absl::StatusOr<UncertainParameter> UncertainParameter::Normal(std::string name, double mean,
                                                              double std_dev) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckLocation(name, "normal", "mean", mean));
  POLYEST_RETURN_IF_ERROR(CheckScale(name, "normal", "standard deviation", std_dev));
  return UncertainParameter{std::move(name), Germ::Normal(), mean, std_dev};
}

absl::StatusOr<UncertainParameter> UncertainParameter::Uniform(std::string name, double lower,
                                                               double upper) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckBounds(name, "uniform", lower, upper));
  return UncertainParameter{std::move(name), Germ::Uniform(), (lower + upper) / 2,
                            (upper - lower) / 2};
}

absl::StatusOr<UncertainParameter> UncertainParameter::Beta(std::string name, double alpha,
                                                            double beta, double lower,
                                                            double upper) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckShape(name, "beta", "alpha", alpha));
  POLYEST_RETURN_IF_ERROR(CheckShape(name, "beta", "beta", beta));
  POLYEST_RETURN_IF_ERROR(CheckBounds(name, "beta", lower, upper));
  return UncertainParameter{std::move(name), Germ::Beta(alpha, beta), (lower + upper) / 2,
                            (upper - lower) / 2};
}

absl::StatusOr<UncertainParameter> UncertainParameter::Gamma(std::string name, double shape,
                                                             double scale, double shift) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckShape(name, "gamma", "shape", shape));
  POLYEST_RETURN_IF_ERROR(CheckScale(name, "gamma", "scale", scale));
  POLYEST_RETURN_IF_ERROR(CheckLocation(name, "gamma", "shift", shift));
  return UncertainParameter{std::move(name), Germ::Gamma(shape), shift, scale};
}

Prior::Prior(std::vector<UncertainParameter> parameters) : parameters_(std::move(parameters)) {
  POLYEST_CHECK(!parameters_.empty());
  const int n = dimension();
  location_.resize(n);
  scale_.resize(n);
  lower_.resize(n);
  upper_.resize(n);
  for (int i = 0; i < n; ++i) {
    const UncertainParameter& parameter = parameters_[i];
    POLYEST_CHECK(parameter.scale > 0);
    location_[i] = parameter.location;
    scale_[i] = parameter.scale;
    lower_[i] = parameter.germ.Lower();
    upper_[i] = parameter.germ.Upper();
  }
}

std::vector<Germ> Prior::germs() const {
  std::vector<Germ> germs;
  germs.reserve(parameters_.size());
  for (const UncertainParameter& parameter : parameters_) germs.push_back(parameter.germ);
  return germs;
}

Vector Prior::ToParameters(const ConstVectorRef& xi) const {
  return location_ + scale_.cwiseProduct(xi);
}

Vector Prior::ToGerm(const ConstVectorRef& theta) const {
  return (theta - location_).cwiseQuotient(scale_);
}

Vector Prior::Mean() const {
  Vector mean(dimension());
  for (int i = 0; i < dimension(); ++i) mean[i] = parameters_[i].germ.Mean();
  return ToParameters(mean);
}

Vector Prior::StandardDeviation() const { return scale_.cwiseProduct(GermStandardDeviation()); }

Vector Prior::GermStandardDeviation() const {
  Vector deviation(dimension());
  for (int i = 0; i < dimension(); ++i) deviation[i] = parameters_[i].germ.StandardDeviation();
  return deviation;
}

bool Prior::Contains(const ConstVectorRef& xi) const {
  for (int i = 0; i < dimension(); ++i) {
    if (!(lower_[i] <= xi[i] && xi[i] <= upper_[i] && std::isfinite(xi[i]))) return false;
  }
  return true;
}

double Prior::NegativeLogDensity(const ConstVectorRef& xi) const {
  if (!Contains(xi)) return std::numeric_limits<double>::infinity();
  double sum = 0;  // J_apriori = −Σ_i log ρ_i(ξ_i)
  for (int i = 0; i < dimension(); ++i) sum -= parameters_[i].germ.LogDensity(xi[i]);
  return sum;
}

Vector Prior::Gradient(const ConstVectorRef& xi) const {
  Vector gradient(dimension());
  for (int i = 0; i < dimension(); ++i) {
    gradient[i] = -parameters_[i].germ.LogDensityDerivative(xi[i]);
  }
  return gradient;
}

Vector Prior::Curvature(const ConstVectorRef& xi) const {
  Vector curvature(dimension());
  for (int i = 0; i < dimension(); ++i) {
    curvature[i] = -parameters_[i].germ.LogDensitySecondDerivative(xi[i]);
  }
  return curvature;
}

}  // namespace polyest
