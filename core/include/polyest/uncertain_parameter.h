#pragma once

// The prior of an uncertain parameter θ, as a map of a standard random variable ξ, its germ:
//   normal, uniform, beta, gamma, truncated normal   θ = location + scale ξ
//   lognormal                                        θ = exp(location + scale ξ), ξ ~ N(0, 1)
//   log-uniform                                      θ = exp(location + scale ξ), ξ on [−1, 1]
//
// Lognormal, from its own mean m and standard deviation s:
//   scale² = log(1 + s²/m²),  location = log m − scale²/2.
// Where a uniform parameter is estimated together with lognormal or log-uniform ones, its germ is
// that of its logarithm: θ = exp(location + scale ξ), ξ exponential of the rate `scale`. Products
// and ratios, all that data often tell of a mass and a stiffness, are then straight lines in ξ.
//
// Estimates are modes of densities of ξ. For an affine θ and a uniform one this is also the mode of
// θ. For a lognormal θ it is the value whose logarithm is most likely: for the prior, e^location,
// which is the median and lies between mode and mean.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <limits>
#include <optional>
#include <string>

namespace polyest {

// The family of a germ's density.
enum class GermFamily {
  kNormal,           // N(0, 1) on ℝ
  kUniform,          // 1/2 on [−1, 1]
  kBeta,             // ∝ (1+ξ)^(α−1) (1−ξ)^(β−1) on [−1, 1]
  kGamma,            // ξ^(shape−1) e^(−ξ) / Γ(shape) on [0, ∞)
  kTruncatedNormal,  // N(0, 1) cut to [lower, upper]
  kExponential,      // ∝ e^(rate ξ) on [−1, 1]; of the logarithm of a uniform parameter
};

// The density of a germ.
struct GermShape {
  GermFamily family = GermFamily::kUniform;  // its kind
  // α of beta, shape of gamma, lower bound of truncated normal, rate of exponential; else 0
  double first = 0;
  double second = 0;  // β of beta, upper bound of truncated normal; else 0
};

// How a germ is mapped to its parameter.
enum class ParameterMap {
  kAffine,       // θ = location + scale ξ
  kExponential,  // θ = exp(location + scale ξ)
};

// A random walk of a parameter in time. In a time Δt its normal score gains a normal step of the
// standard deviation `std_dev_per_sqrt_s` √Δt ÷ the prior's standard deviation, so that it keeps
// within its prior's bounds; for a normal prior, `std_dev_per_sqrt_s` √Δt is that of the step of
// the parameter itself.
struct RandomWalk {
  double std_dev_per_sqrt_s = 0;  // in the parameter's unit/√s, > 0; 0 if unknown
  // Whether it is estimated, as the uncertain parameter "<name>.drift" with a constant prior
  // density of its logarithm between the bounds.
  bool unknown = false;
  // Bounds of an unknown one, 10⁻⁵⁰ ≤ lower < upper ≤ 10⁵⁰ and upper ≤ 10²⁰ lower; else 0.
  double lower = 0, upper = 0;

  friend bool operator==(const RandomWalk&, const RandomWalk&) = default;
};

// What a parameter is of a population (UncertainParameter::population).
enum class PopulationPart {
  kNone,    // a quantity of the model
  kMean,    // the population's median, F⁻¹(Φ(μ)), which for a normal prior is its mean
  kSpread,  // its standard deviation, s times that of a normal prior or of a lognormal's logarithm;
            // s itself for other priors
};

// An uncertain parameter: its name and its prior. Make one with the functions below, which check
// their arguments: INVALID_ARGUMENT names the argument, its value and the rule.
struct UncertainParameter {
  std::string name;                          // of a settable quantity (polyest/problem.h)
  GermShape germ;                            // the density of ξ; uniform by default
  double location = 0;                       // θ, or log θ, at ξ = 0
  double scale = 1;                          // dθ/dξ, or d log θ/dξ, > 0
  ParameterMap map = ParameterMap::kAffine;  // from ξ to θ
  // Each run of the record has a value of its own, all with this prior. Those of runs that have
  // ended are integrated out of the posterior once all would be more parameters than an expansion
  // bears.
  bool per_run = false;
  // How the parameter changes with time, if it does: each run begins at its value θ, and the
  // likelihood is then that of prediction errors (Problem::likelihood). Only parameters of the
  // model can drift, and not initial states nor what others are derived from.
  std::optional<RandomWalk> drift = std::nullopt;
  // Runs share a population, whose mean and spread are estimated with the rest: in units of normal
  // scores g of the prior F, θ = F⁻¹(Φ(g)), run r has g_r ~ N(μ, s²), with the priors μ ~ N(0, 1)
  // and s lognormal with median 0.5 and log-standard deviation 1 (cut off at five of these).
  // Requires `per_run`, an adaptive expansion and a regularization weight of 1; one parameter of a
  // problem may have a population, and it must not be correlated. Runs that have ended are
  // integrated out as soon as the next one begins.
  bool population = false;
  // Which part of a population this is, for the two parameters that are added to a problem with
  // one; those of a problem that is made by hand are kNone.
  PopulationPart part = PopulationPart::kNone;

  // Makes a normal prior. `std_dev` > 0, both in the parameter's unit.
  static absl::StatusOr<UncertainParameter> Normal(std::string name, double mean, double std_dev);
  // Makes a uniform prior on [lower, upper], lower < upper.
  static absl::StatusOr<UncertainParameter> Uniform(std::string name, double lower, double upper);
  // Makes a beta prior on [lower, upper], density ∝ (θ − lower)^(alpha−1) (upper − θ)^(beta−1);
  // alpha and beta from 1 to 10,000.
  static absl::StatusOr<UncertainParameter> Beta(std::string name, double alpha, double beta,
                                                 double lower, double upper);
  // Makes a gamma prior: (θ − shift)/scale has the density x^(shape−1) e^(−x)/Γ(shape); shape from
  // 1 to 10,000, scale > 0.
  static absl::StatusOr<UncertainParameter> Gamma(std::string name, double shape, double scale,
                                                  double shift);
  // Makes a lognormal prior. `mean` and `std_dev` are those of the quantity itself,
  // 0 < std_dev ≤ 100 mean.
  static absl::StatusOr<UncertainParameter> Lognormal(std::string name, double mean,
                                                      double std_dev);
  // Makes a prior with a constant density of log θ on [lower, upper], 0 < lower < upper.
  static absl::StatusOr<UncertainParameter> LogUniform(std::string name, double lower,
                                                       double upper);
  // Makes a normal prior cut to [lower, upper]. `mean` and `std_dev` are those before the cut;
  // either bound may be infinite. At least 10⁻⁶ of the normal's probability must lie between them.
  static absl::StatusOr<UncertainParameter> TruncatedNormal(
      std::string name, double mean, double std_dev,
      double lower = -std::numeric_limits<double>::infinity(),
      double upper = std::numeric_limits<double>::infinity());

  // Returns OK for what the functions above make, else INVALID_ARGUMENT.
  absl::Status Validate() const;

  // Returns the θ of a germ's value.
  double ToParameter(double xi) const;
  // Returns the germ's value of a θ; not a number for a θ ≤ 0 of a lognormal or log-uniform one.
  double ToGerm(double theta) const;
  // Returns dθ/dξ at a germ's value.
  double Slope(double xi) const;
  // Returns the prior's mean of θ.
  double Mean() const;
  // Returns the prior's standard deviation of θ.
  double StandardDeviation() const;
};

// A correlation of two uncertain parameters in the prior, by a Gaussian copula: it is that of their
// normal scores. For two normal parameters, or the logarithms of two lognormal ones, it is their
// own; Spearman's is (6/π) asin(coefficient/2).
struct Correlation {
  std::string first, second;  // names of two different uncertain parameters
  double coefficient = 0;     // −1 < coefficient < 1
};

}  // namespace polyest
