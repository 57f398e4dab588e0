#include "polyest/uncertain_parameter.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/chaos/germ.h"
#include "core/chaos/truncated_normal.h"
#include "core/common/field_error.h"
#include "core/common/status.h"

namespace polyest {

using namespace internal;

namespace {

// The limits between which squares are finite numbers.
constexpr double kMinScale = 1e-100;
constexpr double kMaxMagnitude = 1e100;
// The shape beyond which a beta or gamma density is normal to within a percent.
constexpr double kMaxShape = 10'000;
// The greatest standard deviation ÷ mean of a lognormal: e^(37 scale) is still a number, and 100 is
// a factor of 430 either way.
constexpr double kMaxRatio = 100;

absl::Status CheckName(const std::string& name) {
  if (name.empty()) return InvalidField("name", "must not be empty");
  return absl::OkStatus();
}

absl::Status CheckLocation(const char* family, const char* field, double value) {
  if (std::abs(value) <= kMaxMagnitude) return absl::OkStatus();
  return InvalidField({family, field}, absl::StrCat(value, " must be finite and at most ",
                                                    kMaxMagnitude, " in magnitude"));
}

absl::Status CheckScale(const char* family, const char* field, double value) {
  if (!(value > 0)) return InvalidField({family, field}, absl::StrCat(value, " must be > 0"));
  if (value >= kMinScale && value <= kMaxMagnitude) return absl::OkStatus();
  return InvalidField({family, field},
                      absl::StrCat(value, " must lie between ", kMinScale, " and ", kMaxMagnitude));
}

absl::Status CheckShape(const char* family, const char* field, double value) {
  if (value >= 1 && value <= kMaxShape) return absl::OkStatus();
  return InvalidField({family, field}, absl::StrCat(value, " must lie between 1 and ", kMaxShape));
}

absl::Status CheckBounds(const char* family, double lower, double upper) {
  POLYEST_RETURN_IF_ERROR(CheckLocation(family, "lower", lower));
  POLYEST_RETURN_IF_ERROR(CheckLocation(family, "upper", upper));
  if (!(lower < upper)) {
    return InvalidField(family, absl::StrCat("lower ", lower, " must be below upper ", upper));
  }
  if (upper - lower >= kMinScale) return absl::OkStatus();
  return InvalidField(family, absl::StrCat("upper ", upper, " must be above lower ", lower,
                                           " by at least ", kMinScale));
}

bool IsLogUniform(const UncertainParameter& parameter) {
  return parameter.map == ParameterMap::kExponential &&
         parameter.germ.family == GermFamily::kUniform;
}

bool IsUniformByLogarithm(const UncertainParameter& parameter) {
  return parameter.map == ParameterMap::kExponential &&
         parameter.germ.family == GermFamily::kExponential;
}

bool IsCutLognormal(const UncertainParameter& parameter) {
  return parameter.map == ParameterMap::kExponential &&
         parameter.germ.family == GermFamily::kTruncatedNormal;
}

// Returns E[e^(kσξ)] = e^(k²σ²/2) P(a − kσ, b − kσ)/P(a, b) of a normal ξ cut to [a, b].
double CutMoment(const UncertainParameter& parameter, int k) {
  const double a = parameter.germ.first, b = parameter.germ.second, t = k * parameter.scale;
  return std::exp(0.5 * t * t) * NormalProbability(a - t, b - t) / NormalProbability(a, b);
}

}  // namespace

absl::StatusOr<UncertainParameter> UncertainParameter::Normal(std::string name, double mean,
                                                              double std_dev) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckLocation("normal", "mean", mean));
  POLYEST_RETURN_IF_ERROR(CheckScale("normal", "std_dev", std_dev));
  return UncertainParameter{std::move(name), Germ::Normal(), mean, std_dev};
}

absl::StatusOr<UncertainParameter> UncertainParameter::Uniform(std::string name, double lower,
                                                               double upper) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckBounds("uniform", lower, upper));
  return UncertainParameter{std::move(name), Germ::Uniform(), (lower + upper) / 2,
                            (upper - lower) / 2};
}

absl::StatusOr<UncertainParameter> UncertainParameter::Beta(std::string name, double alpha,
                                                            double beta, double lower,
                                                            double upper) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckShape("beta", "alpha", alpha));
  POLYEST_RETURN_IF_ERROR(CheckShape("beta", "beta", beta));
  POLYEST_RETURN_IF_ERROR(CheckBounds("beta", lower, upper));
  return UncertainParameter{std::move(name), Germ::Beta(alpha, beta), (lower + upper) / 2,
                            (upper - lower) / 2};
}

absl::StatusOr<UncertainParameter> UncertainParameter::Gamma(std::string name, double shape,
                                                             double scale, double shift) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckShape("gamma", "shape", shape));
  POLYEST_RETURN_IF_ERROR(CheckScale("gamma", "scale", scale));
  POLYEST_RETURN_IF_ERROR(CheckLocation("gamma", "shift", shift));
  return UncertainParameter{std::move(name), Germ::Gamma(shape), shift, scale};
}

absl::StatusOr<UncertainParameter> UncertainParameter::Lognormal(std::string name, double mean,
                                                                 double std_dev) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckScale("lognormal", "mean", mean));
  POLYEST_RETURN_IF_ERROR(CheckScale("lognormal", "std_dev", std_dev));
  if (std_dev > kMaxRatio * mean) {
    return InvalidField(
        {"lognormal", "std_dev"},
        absl::StrCat(std_dev, " must be at most ", kMaxRatio, " times the mean ", mean));
  }
  // scale² = log(1 + s²/m²), location = log m − scale²/2
  const double ratio = std_dev / mean;
  const double variance = std::log1p(ratio * ratio);
  return UncertainParameter{std::move(name), Germ::Normal(), std::log(mean) - 0.5 * variance,
                            std::sqrt(variance), ParameterMap::kExponential};
}

absl::StatusOr<UncertainParameter> UncertainParameter::LogUniform(std::string name, double lower,
                                                                  double upper) {
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckScale("log_uniform", "lower", lower));
  POLYEST_RETURN_IF_ERROR(CheckBounds("log_uniform", lower, upper));
  return UncertainParameter{std::move(name), Germ::Uniform(),
                            0.5 * (std::log(lower) + std::log(upper)),
                            0.5 * (std::log(upper) - std::log(lower)), ParameterMap::kExponential};
}

absl::StatusOr<UncertainParameter> UncertainParameter::TruncatedNormal(std::string name,
                                                                       double mean, double std_dev,
                                                                       double lower, double upper) {
  constexpr char kFamily[] = "truncated_normal";
  POLYEST_RETURN_IF_ERROR(CheckName(name));
  POLYEST_RETURN_IF_ERROR(CheckLocation(kFamily, "mean", mean));
  POLYEST_RETURN_IF_ERROR(CheckScale(kFamily, "std_dev", std_dev));
  if (!(lower < upper)) {
    return InvalidField(kFamily, absl::StrCat("lower ", lower, " must be below upper ", upper));
  }
  const double a = (lower - mean) / std_dev, b = (upper - mean) / std_dev;
  const double probability = NormalProbability(a, b);
  if (!(probability >= Germ::kMinTruncatedProbability)) {
    return InvalidField(
        kFamily, absl::StrFormat("only %g of the normal's probability lies between lower %g and "
                                 "upper %g; it must be at least %g",
                                 probability, lower, upper, Germ::kMinTruncatedProbability));
  }
  return UncertainParameter{std::move(name), Germ::TruncatedNormal(a, b), mean, std_dev};
}

absl::Status UncertainParameter::Validate() const {
  const auto is_shape = [](double shape) { return shape >= 1 && shape <= kMaxShape; };
  bool valid = !name.empty() && std::abs(location) <= kMaxMagnitude && scale >= kMinScale &&
               scale <= kMaxMagnitude;
  // A lognormal must be the exponential of a normal, which may be cut off, of a ratio of at most
  // kMaxRatio; a log-uniform one must lie within the limits of magnitude.
  if (map == ParameterMap::kExponential && germ.family != GermFamily::kUniform) {
    valid = valid &&
            (germ.family == GermFamily::kNormal || germ.family == GermFamily::kTruncatedNormal) &&
            std::expm1(scale * scale) <= 1.0001 * kMaxRatio * kMaxRatio;
  } else if (map == ParameterMap::kExponential) {
    valid = valid && std::abs(location) + scale <= 1.0001 * std::log(kMaxMagnitude);
  }
  if (germ.family == GermFamily::kBeta) valid = valid && is_shape(germ.second);
  if (germ.family == GermFamily::kBeta || germ.family == GermFamily::kGamma) {
    valid = valid && is_shape(germ.first);
  }
  if (germ.family == GermFamily::kTruncatedNormal) {
    valid = valid && germ.first < germ.second &&
            NormalProbability(germ.first, germ.second) >= Germ::kMinTruncatedProbability;
  }
  if (valid) return absl::OkStatus();
  return InvalidField(FieldPath(), "is not a prior that UncertainParameter's functions make");
}

double UncertainParameter::ToParameter(double xi) const {
  const double affine = location + scale * xi;
  return map == ParameterMap::kExponential ? std::exp(affine) : affine;
}

double UncertainParameter::ToGerm(double theta) const {
  const double affine = map == ParameterMap::kExponential ? std::log(theta) : theta;
  return (affine - location) / scale;
}

double UncertainParameter::Slope(double xi) const {
  return map == ParameterMap::kExponential ? scale * ToParameter(xi) : scale;
}

double UncertainParameter::Mean() const {
  // The mean is E[e^(μ + σξ)] = e^μ sinh(σ)/σ for a uniform ξ.
  if (IsLogUniform(*this)) return std::exp(location) * std::sinh(scale) / scale;
  if (IsUniformByLogarithm(*this)) return 0.5 * (ToParameter(-1) + ToParameter(1));
  if (IsCutLognormal(*this)) return std::exp(location) * CutMoment(*this, 1);
  // The mean is E[e^(μ + σξ)] = e^(μ + σ²/2).
  if (map == ParameterMap::kExponential) return std::exp(location + 0.5 * scale * scale);
  return location + scale * Germ(germ).Mean();
}

double UncertainParameter::StandardDeviation() const {
  // The mean square is e^(2μ) sinh(2σ)/(2σ).
  if (IsLogUniform(*this)) {
    // For close bounds the difference would be rounding errors; it is σ²/3 + 4σ⁴/45 + ….
    const double mean = std::sinh(scale) / scale, square = scale * scale;
    const double variance = scale < 0.01 ? square / 3 + 4 * square * square / 45
                                         : std::sinh(2 * scale) / (2 * scale) - mean * mean;
    return std::exp(location) * std::sqrt(variance);
  }
  // The range is 2 e^μ sinh σ.
  if (IsUniformByLogarithm(*this)) {
    return std::exp(location) * std::sinh(scale) / std::numbers::sqrt3;
  }
  if (IsCutLognormal(*this)) {
    const double mean = CutMoment(*this, 1);
    return std::exp(location) * std::sqrt(CutMoment(*this, 2) - mean * mean);
  }
  // The standard deviation is mean √(e^(σ²) − 1).
  if (map == ParameterMap::kExponential) return Mean() * std::sqrt(std::expm1(scale * scale));
  return scale * Germ(germ).StandardDeviation();
}

}  // namespace polyest
