#pragma once

// The prior of the uncertain parameters: each an affine map of an independent germ,
//   θ_i = location_i + scale_i ξ_i,   J_apriori(ξ) = −Σ_i log ρ_i(ξ_i)   (25).

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/chaos/germ.h"
#include "core/common/types.h"

namespace polyest {

struct UncertainParameter {
  std::string name;
  Germ germ = Germ::Uniform();
  double location = 0;  // θ at ξ = 0
  double scale = 1;     // dθ/dξ > 0

  // INVALID_ARGUMENT names the parameter, the value and the rule.
  static absl::StatusOr<UncertainParameter> Normal(std::string name, double mean, double std_dev);
  static absl::StatusOr<UncertainParameter> Uniform(std::string name, double lower, double upper);
  static absl::StatusOr<UncertainParameter> Beta(std::string name, double alpha, double beta,
                                                 double lower, double upper);
  static absl::StatusOr<UncertainParameter> Gamma(std::string name, double shape, double scale,
                                                  double shift);
};

class Prior {
 public:
  explicit Prior(std::vector<UncertainParameter> parameters);

  int dimension() const { return static_cast<int>(parameters_.size()); }
  const std::vector<UncertainParameter>& parameters() const { return parameters_; }
  std::vector<Germ> germs() const;

  Vector ToParameters(const ConstVectorRef& xi) const;
  Vector ToGerm(const ConstVectorRef& theta) const;
  Vector scale() const { return scale_; }  // dθ/dξ
  Vector Mean() const;                     // of θ
  Vector StandardDeviation() const;        // of θ
  Vector GermStandardDeviation() const;    // of ξ
  // Ω in germ coordinates; ±∞ where the germ has no bound.
  const Vector& lower() const { return lower_; }
  const Vector& upper() const { return upper_; }
  bool Contains(const ConstVectorRef& xi) const;  // ξ ∈ Ω

  // J_apriori and its derivatives; +∞ outside Ω. gradient and curvature (the diagonal of the
  // Hessian) are n.
  double NegativeLogDensity(const ConstVectorRef& xi) const;
  Vector Gradient(const ConstVectorRef& xi) const;
  Vector Curvature(const ConstVectorRef& xi) const;

 private:
  std::vector<UncertainParameter> parameters_;
  Vector location_, scale_, lower_, upper_;
};

}  // namespace polyest
