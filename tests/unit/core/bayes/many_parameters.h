#pragma once

// Makes problems of many parameters, each measured by itself, which order 1 represents exactly.

#include <memory>
#include <string>
#include <vector>

#include "core/bayes/cost.h"

namespace polyest::internal {

inline Prior ManyUniforms(int n) {
  std::vector<UncertainParameter> parameters;
  for (int i = 0; i < n; ++i) {
    parameters.push_back(UncertainParameter::Uniform("p" + std::to_string(i), -1, 1).value());
  }
  return Prior(parameters);
}

inline Prior ManyNormals(int n) {
  std::vector<UncertainParameter> parameters;
  for (int i = 0; i < n; ++i) {
    parameters.push_back(UncertainParameter::Normal("p" + std::to_string(i), 0, 1).value());
  }
  return Prior(parameters);
}

// Returns the cost of the data ξ_i = z_i with the noise σ, for each of the first `z.size()`
// parameters.
inline Cost CostOfEach(const Prior& prior, const Vector& z, double noise) {
  const int n = prior.dimension();
  const auto basis = std::make_shared<const Basis>(prior.germs(), 1);
  Vector at_zero(n + 1), at_unit(n + 1);
  basis->Evaluate(Vector::Zero(n), at_zero);
  MismatchSums sums(n + 1);
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    // ξ_i = φ_s(ξ)/φ_s(e_i), where s is the term that alone differs between 0 and e_i.
    basis->Evaluate(Vector::Unit(n, i), at_unit);
    const Vector slope = at_unit - at_zero;
    sums.Add(slope / slope.squaredNorm(), z[i], noise * noise);
  }
  return Cost(basis, Region::WholePrior(n), Vector::Zero(n), sums, prior, 1);
}

}  // namespace polyest::internal
