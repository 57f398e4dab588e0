// Ensembles of equations that switch, and how a test compares their trajectories with closed forms.

#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "core/model/equations/equation_model.h"
#include "tests/unit/core/propagation/ensemble.h"

namespace polyest::internal {

// An ensemble of equations, with parameter values by point.
struct Equations {
  Equations(EquationSpecification equations, int points, std::vector<const char*> outputs)
      : ensemble(*MakeEquationModel(equations), points, std::move(outputs)) {}
  double At(Eigen::Index point, const char* parameter) const {
    const int index = *ensemble.Description().FindParameter(parameter);
    return ensemble.specification.parameters(point, index);
  }
  Ensemble ensemble;
};

// A right-hand side, its outputs x and y, and values of parameters by point.
inline Matrix Propagated(const EquationSpecification& equations, const char* parameter,
                         const std::vector<double>& values, const std::vector<double>& times_s,
                         double tolerance = 1e-9) {
  Equations made(equations, static_cast<int>(values.size()),
                 {equations.outputs.begin()->first.c_str()});
  for (size_t point = 0; point < values.size(); ++point) {
    made.ensemble.Set(parameter, static_cast<int>(point), values[point]);
  }
  made.ensemble.specification.integration.relative_tolerance = tolerance;
  Matrix y = made.ensemble.Propagate(times_s);
  for (const PointFailure& failure : made.ensemble.failures) {
    ADD_FAILURE() << failure.point << " at " << failure.time_s << ": " << failure.reason;
  }
  return y;
}

// Compares the only output with a function of the time and the value of the parameter.
template <class Exact>
void ExpectMotion(const EquationSpecification& equations, const char* parameter,
                  const std::vector<double>& values, double end_s, double step_s, double tolerance,
                  const Exact& exact) {
  const std::vector<double> times_s = TimesUntil(end_s, step_s);
  const Matrix y = Propagated(equations, parameter, values, times_s);
  for (Eigen::Index point = 0; point < y.rows(); ++point) {
    for (Eigen::Index i = 0; i < y.cols(); ++i) {
      const double t = times_s[static_cast<size_t>(i)];
      ASSERT_NEAR(y(point, i), exact(t, values[static_cast<size_t>(point)]), tolerance)
          << "t = " << t << ", " << parameter << " = " << values[static_cast<size_t>(point)];
    }
  }
}

inline std::vector<double> Evenly(double first, double last, int number) {
  std::vector<double> values;
  for (int i = 0; i < number; ++i) values.push_back(first + (last - first) * i / (number - 1));
  return values;
}

// Errors at rtol = 1e-9: a few hundred local errors of that size.
inline constexpr double kAccumulated = 300e-9;
}  // namespace polyest::internal
