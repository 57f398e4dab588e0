#pragma once

// The small models of the problems, each as equations for polyest and in closed form:
//   y(t) = g_0(t; ν) + Σ_j β_j g_j(t; ν),
// nonlinear in at most two unknowns ν and linear in at most four unknowns β. With normal priors of
// β the posterior given ν is normal, so only ν needs a grid.

#include <functional>
#include <string>
#include <vector>

#include "polyest/equation_model.h"
#include "tests/properties/density.h"

namespace polyest::internal::properties {

inline constexpr int kMaxLinear = 4;

struct Law {
  struct Nonlinear {
    std::string name;
    Density density;
  };
  struct Linear {
    std::string name;
    double mean, std_dev;  // of its normal prior
  };

  std::string name;
  EquationSpecification equations;  // with one output, y
  std::vector<Nonlinear> nonlinear;
  std::vector<Linear> linear;
  // Writes g_0 … g_p at t for the parameters ν.
  std::function<void(const double* nu, double t, double* g)> shapes;
  double until_s = 1;  // samples lie in (0, until_s]
};

// Draws one of the laws with its priors.
Law DrawLaw(Random& random);

}  // namespace polyest::internal::properties
