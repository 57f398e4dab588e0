#pragma once

// The rules that choose the regularization weight α² of (56), J = J_mismatch + α² J_apriori, from
// the minima of J for several α². Three rules search the range 10⁻⁴ … 10⁴ with four values a
// decade. A rule without an answer says why; α² is then 1, as in Bayes' rule.
//
// L-curve         l_curve.h.
// Discrepancy     The largest α² whose minimum still fits the data as well as their noise allows,
//                   2 J_mismatch(ξ̂(α²)) ≤ N − γ(α²),
//                 N the degrees of freedom of the samples, γ(α²) = Σ λ_i/(1 + λ_i) the parameters
//                 that the data fit, λ the eigenvalues of the data's information ÷ that of the
//                 prior of weight α². The size of the noise must be known. χ² scatters by √(2N), so
//                 for N ≫ n chance decides: half of all right models fit too badly at every α²,
//                 which is no answer, and many of the others are moved towards the prior by more
//                 than their uncertainty. The rule suits few and noisy data.
// Evidence        The α² that makes the data most probable: the largest marginal likelihood
//                   p(z | α²) = ∫ e^{−J_mismatch} ρ^{α²} dξ/Z(α²),
//                 ρ^{α²}/Z the prior of weight α² (regularization_prior.h), the integral by
//                 Laplace's approximation about ξ̂,
//                   log p = −J(ξ̂) − log Z + (n/2) log 2π − ½ log det H(ξ̂),
//                 H the second derivative of J, in each direction at least the inverse of the
//                 variance of the prior of weight α²: a flat direction is not wider than the prior.
//                 For a parameter i that is left to the prior, the approximation has the error that
//                 it has for Z_i itself. The share 1 − γ_i that the data do not fit therefore takes
//                 log Z_i by Laplace's approximation too, so that data without information prefer
//                 no α².
//                 The rule is exact for linear outputs and normal priors. Its answer is a maximum
//                 inside the range from which log p falls by ½ towards both ends (one standard
//                 deviation of log α²). Uniform priors have no weight: if all are uniform the
//                 evidence is flat.
//
// Sources: V. A. Morozov, Methods for Solving Incorrectly Posed Problems (1984), discrepancy;
// D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992), evidence and γ.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/bayes/cost.h"
#include "polyest/regularization.h"

namespace polyest::internal {

// The minimum of J for one α².
struct RegularizedMinimum {
  double regularization = 1;  // α² > 0
  Vector point;               // n, local coordinates η
  CostValue cost;
  double effective_parameters = 0;  // γ, 0 … n
  double log_evidence = 0;          // log p(z | α²), up to a constant of the data
  bool converged = true;
};

// Describes the minimum at η of a cost with α² > 0; nothing if the curvature there is not finite.
std::optional<RegularizedMinimum> DescribeMinimum(const Cost& cost, const ConstVectorRef& eta);

// Returns the minimum for an α², or nothing if there is none that can be trusted.
using MinimumAt = std::function<std::optional<RegularizedMinimum>(double regularization)>;

// Returns the minima for those of `values` (ascending, > 0) that have one. It computes them from
// the largest value down, so that each is near the one before and the first near the prior's mode.
std::vector<RegularizedMinimum> SweepRegularization(const Vector& values, const MinimumAt& minimum);

// Returns `count` ≥ 1 values from lowest to highest, evenly spaced in their logarithms.
Vector LogarithmicRange(double lowest, double highest, int count);

// Returns the 33 values that the rules search.
Vector RangeOfChoice();

// Choose from `points`, the sweep over RangeOfChoice(), and refine between two of its values to a
// relative 10⁻⁴ or better. `degrees` is N.
RegularizationChoice ChooseByDiscrepancy(const std::vector<RegularizedMinimum>& points,
                                         const MinimumAt& minimum, double degrees);
RegularizationChoice ChooseByEvidence(const std::vector<RegularizedMinimum>& points,
                                      const MinimumAt& minimum);

}  // namespace polyest::internal
