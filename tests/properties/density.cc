#include "tests/properties/density.h"

#include <cmath>

namespace polyest::internal::properties {
namespace {

constexpr double kReach = 8.5;  // standard deviations; 2·10⁻¹⁷ of a normal density lies outside

}  // namespace

double Random::LogUniform(double lower, double upper) {
  return std::exp(Uniform(std::log(lower), std::log(upper)));
}

Density::Density(Family family, double first, double second)
    : family_(family), first_(first), second_(second), lower_(first), upper_(second) {
  if (family == Family::kNormal || family == Family::kLognormal) {
    lower_ = first - kReach * second;
    upper_ = first + kReach * second;
  }
}

Density Density::Uniform(double lower, double upper) { return {Family::kUniform, lower, upper}; }
Density Density::Normal(double mean, double std_dev) { return {Family::kNormal, mean, std_dev}; }
Density Density::Lognormal(double median, double log_std_dev) {
  return {Family::kLognormal, std::log(median), log_std_dev};
}
Density Density::Parabola(double lower, double upper) { return {Family::kParabola, lower, upper}; }

double Density::LogDensity(double c) const {
  switch (family_) {
    case Family::kUniform:
      return 0;
    case Family::kNormal:
    case Family::kLognormal:
      return -0.5 * (c - first_) / second_ * (c - first_) / second_;
    case Family::kParabola:
      return std::log((c - lower_) * (upper_ - c));
  }
  return 0;
}

double Density::ToParameter(double c) const {
  return family_ == Family::kLognormal ? std::exp(c) : c;
}

double Density::Draw(Random& random) const {
  switch (family_) {
    case Family::kUniform:
      return random.Uniform(lower_, upper_);
    case Family::kNormal:
    case Family::kLognormal:
      return first_ + second_ * random.Normal();
    case Family::kParabola:
      break;
  }
  // The middle one of three uniform numbers has the density 6 x (1 − x).
  const double a = random.Uniform(0, 1), b = random.Uniform(0, 1), c = random.Uniform(0, 1);
  const double middle = std::max(std::min(a, b), std::min(std::max(a, b), c));
  return lower_ + (upper_ - lower_) * middle;
}

UncertainParameter Density::Parameter(const std::string& name) const {
  switch (family_) {
    case Family::kUniform:
      return *UncertainParameter::Uniform(name, lower_, upper_);
    case Family::kNormal:
      return *UncertainParameter::Normal(name, first_, second_);
    case Family::kLognormal: {
      const double mean = std::exp(first_ + 0.5 * second_ * second_);
      return *UncertainParameter::Lognormal(name, mean,
                                            mean * std::sqrt(std::expm1(second_ * second_)));
    }
    case Family::kParabola:
      break;
  }
  return *UncertainParameter::Beta(name, 2, 2, lower_, upper_);
}

}  // namespace polyest::internal::properties
