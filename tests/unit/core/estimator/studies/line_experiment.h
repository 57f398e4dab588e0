#pragma once

// Makes experiments on a straight line, whose posterior has a closed form.

#include <cmath>
#include <utility>
#include <vector>

#include "core/model/equations/equation_model.h"
#include "tests/unit/core/estimator/studies/resolve.h"

namespace polyest::internal::line_experiment {

inline UncertainParameter Normal(const char* name, double mean, double std_dev) {
  return UncertainParameter::Normal(name, mean, std_dev).value();
}

inline Problem ProblemOf(EquationSpecification equations,
                         std::vector<UncertainParameter> uncertain) {
  Problem problem;
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = std::move(uncertain);
  return problem;
}

// Makes x = x_0 + a t, x_0 ~ N(0, 2²), a ~ N(1, 3²), with x measured with σ = 0.5. The rate v = a
// is not measured.
inline Problem Line() {
  Problem problem = ProblemOf({.states = {{"x", "a"}}, .outputs = {{"v", "a"}, {"x", "x"}}},
                              {Normal("x_0", 0, 2), Normal("a", 1, 3)});
  problem.measured = {{"x", {.absolute = 0.5}}};
  return problem;
}

// Returns the posterior covariance of (x_0, a) after samples of x at these times with σ = 0.5.
inline Eigen::Matrix2d LineCovariance(const std::vector<double>& time_s) {
  Eigen::Matrix2d precision = Eigen::Vector2d(1.0 / 4, 1.0 / 9).asDiagonal();
  for (const double t : time_s) {
    const Eigen::Vector2d slope(1, t);
    precision += slope * slope.transpose() / 0.25;
  }
  return precision.inverse();
}

// Returns ½ log₂ of prior over posterior determinant.
inline double LineBits(const Eigen::Matrix2d& covariance) {
  return 0.5 * std::log2(4 * 9 / covariance.determinant());
}

}  // namespace polyest::internal::line_experiment
