#pragma once

// The prior of the uncertain parameters, as a map θ = T(ξ) of independent germs:
//   z = F ξ,   θ_i = t_i(z_i),   J_apriori(ξ) = −Σ_i log ρ_i(ξ_i)   (25).
//
// z_i is the score of parameter i, with the density ρ_i of its germ. Without correlations F = I,
// and t_i is the parameter's own map (uncertain_parameter.h). The parameters that occur in a
// correlation have standard normal germs and scores, F Fᵀ = P (copula.h; F lower triangular, rows
// and columns of the others those of I), and t_i maps to the parameter of the same cumulative
// probability; so are those of a population (population_cost.h). So every t_i increases, and
// parameter i's marginal is that of its score.

#include <absl/status/statusor.h>

#include <vector>

#include "core/bayes/copula.h"
#include "core/chaos/germ.h"
#include "core/common/types.h"
#include "polyest/uncertain_parameter.h"

namespace polyest::internal {

class Prior {
 public:
  // Makes independent parameters, at least one.
  explicit Prior(std::vector<UncertainParameter> parameters);
  // Requires at least one parameter; returns INVALID_ARGUMENT as CorrelationMatrix does.
  static absl::StatusOr<Prior> Make(std::vector<UncertainParameter> parameters,
                                    const std::vector<Correlation>& correlations);

  int dimension() const { return static_cast<int>(parameters_.size()); }
  const std::vector<UncertainParameter>& parameters() const { return parameters_; }
  // Returns the prior with uniform germs in place of the exponential ones, for the search of modes:
  // J_apriori is then constant in such a parameter, as the density of a uniform θ is.
  Prior WithModesOfUniform() const;
  bool has_exponential_germs() const;  // whether that makes a difference

  std::vector<std::string> Names() const;  // of the parameters, in order
  // The germs of ξ_i and z_i: normal for a parameter that is correlated or of a population,
  // whatever the germ of its marginal.
  const std::vector<Germ>& germs() const { return germs_; }
  const Matrix& factor() const { return factor_; }  // F
  bool correlated() const { return correlated_; }
  bool IsCurved(int parameter) const;  // whether t_i is anything but affine

  Vector ToParameters(const ConstVectorRef& xi) const;
  // Returns ±∞ at a bound of a parameter that is correlated or of a population, and not a number
  // outside of its bounds.
  Vector ToGerm(const ConstVectorRef& theta) const;
  Matrix Jacobian(const ConstVectorRef& xi) const;  // ∂θ/∂ξ, n × n

  Vector ToScores(const ConstVectorRef& xi) const;     // z = F ξ
  Vector OfScores(const ConstVectorRef& z) const;      // ξ = F⁻¹ z
  double OfScore(int parameter, double z) const;       // θ_i = t_i(z_i)
  double ScoreOf(int parameter, double theta) const;   // its inverse, as ToGerm
  double SlopeOfScore(int parameter, double z) const;  // t_i′(z_i)
  // Returns the value x of the parameter's own germ, θ_i = parameters()[i].ToParameter(x); it is z
  // for a parameter that is neither correlated nor of a population.
  double MarginalGerm(int parameter, double z) const;

  Vector Mean() const;                   // of θ
  Vector StandardDeviation() const;      // of θ
  Vector GermStandardDeviation() const;  // of ξ, and of z
  // The bounds of Ω in germ coordinates; ±∞ where the germ has none.
  const Vector& lower() const { return lower_; }
  const Vector& upper() const { return upper_; }
  bool Contains(const ConstVectorRef& xi) const;  // ξ ∈ Ω
  // Returns the distance that searches keep from a germ's bounds, where a density that vanishes has
  // no finite cost: 10⁻⁹ of the width of Ω, or of 1 where Ω has none.
  double OffBound(int parameter) const;

  // J_apriori (+∞ outside Ω), its gradient (n) and its curvature, the diagonal of the Hessian (n).
  double NegativeLogDensity(const ConstVectorRef& xi) const;
  // Writes J_apriori at each row of `xis` (rows × n, all numbers) into `values` (rows).
  void NegativeLogDensityMany(const ConstMatrixRef& xis, VectorRef values) const;
  Vector Gradient(const ConstVectorRef& xi) const;
  Vector Curvature(const ConstVectorRef& xi) const;

 private:
  Prior(std::vector<UncertainParameter> parameters, const Matrix& correlation);

  // Whether the parameter's germ and score are standard normal for the copula or a population.
  bool HasNormalScore(int parameter) const {
    return has_normal_score_[static_cast<size_t>(parameter)];
  }

  std::vector<UncertainParameter> parameters_;
  std::vector<Germ> marginal_germs_;  // of the parameters, whether correlated or not
  std::vector<Germ> germs_;
  std::vector<bool> has_normal_score_;
  bool correlated_ = false;
  Matrix factor_;
  Vector lower_, upper_;
};

}  // namespace polyest::internal
