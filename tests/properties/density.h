#pragma once

// Priors of one parameter whose densities are written down here and not taken from the library.

#include <random>
#include <string>

#include "polyest/uncertain_parameter.h"

namespace polyest::internal::properties {

// Random numbers of one problem.
class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}
  double Uniform(double lower, double upper) {
    return lower + (upper - lower) * std::uniform_real_distribution<double>()(engine_);
  }
  double LogUniform(double lower, double upper);
  double Normal() { return std::normal_distribution<double>()(engine_); }
  int Integer(int lowest, int highest) {
    return std::uniform_int_distribution<int>(lowest, highest)(engine_);
  }
  bool Chance(double probability) { return Uniform(0, 1) < probability; }

 private:
  std::mt19937_64 engine_;
};

// A density of a coordinate c, and the parameter θ of which c is the coordinate: θ = e^c if the
// prior is lognormal, else θ = c.
class Density {
 public:
  static Density Uniform(double lower, double upper);
  static Density Normal(double mean, double std_dev);
  // Takes the median of θ and the standard deviation of log θ.
  static Density Lognormal(double median, double log_std_dev);
  // Makes a density ∝ (c − lower)(upper − c).
  static Density Parabola(double lower, double upper);

  // The range outside of which there is less than 10⁻¹⁷ of the probability.
  double lower() const { return lower_; }
  double upper() const { return upper_; }
  // Returns the logarithm of the density of c up to a constant.
  double LogDensity(double c) const;
  double ToParameter(double c) const;
  double Draw(Random& random) const;  // of c
  UncertainParameter Parameter(const std::string& name) const;

 private:
  enum class Family { kUniform, kNormal, kLognormal, kParabola };
  Density(Family family, double first, double second);

  Family family_;
  double first_, second_;  // lower and upper bound, or mean and standard deviation of c
  double lower_, upper_;
};

}  // namespace polyest::internal::properties
