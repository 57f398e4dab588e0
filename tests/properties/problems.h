#pragma once

// Random small problems whose posteriors can be computed exactly.

#include <cstdint>
#include <vector>

#include "core/common/types.h"
#include "polyest/problem.h"
#include "polyest/samples.h"
#include "tests/properties/laws.h"

namespace polyest::internal::properties {

struct SmallProblem {
  Law law;
  Problem problem;  // for polyest: the unknowns are the law's ν, then its β
  Samples record;
  Vector truth;                // in the same order
  Matrix linear_covariance;    // of the prior of β
  double sigma = 0;            // standard deviation of the noise
  bool sigma_unknown = false;  // then log σ has a flat prior
  double time_constant_s = 0;  // of the noise's correlation, known; 0: white
};

// Draws the problem of this seed.
SmallProblem DrawProblem(uint64_t seed);

// Returns the problem in a few lines, for people who look into a failure.
std::string Describe(const SmallProblem& problem);

// Returns the outputs y(t_k) of a law for the unknowns of a problem.
std::vector<double> Outputs(const Law& law, const Vector& theta, const std::vector<double>& time_s);

// Takes the correlation of neighbouring numbers out of them: u_k = (x_k − a_k x_{k−1})/√(1 − a_k²),
// a_k = e^{−(t_k − t_{k−1})/τ}, u_0 = x_0.
void Whiten(const std::vector<double>& time_s, double time_constant_s, std::vector<double>& values);

// Returns, for each of ν, the step over which the samples' expectations change by no more than the
// noise, wherever in the prior: the coarsest grid that cannot miss a piece of the posterior.
Vector SafeSteps(const SmallProblem& problem);

// The nodes of a grid of such steps over the prior of ν may be this many.
inline constexpr double kMaxNodes = 40'000;
double NodesOf(const SmallProblem& problem, const Vector& steps);

}  // namespace polyest::internal::properties
