#pragma once

// Choice of the regularization weight α² of (56), J = J_mismatch + α² J_apriori, from the minima of
// J for several α². Three rules, on the same range 10⁻⁴ … 10⁴, four values a decade; each may have
// no answer, and says why. Then α² is 1, which is what Bayes' rule asks for.
//
// L-curve         l_curve.h.
// Discrepancy     The largest α² whose minimum still meets the data as well as their noise allows,
//                   2 J_mismatch(ξ̂(α²)) ≤ N − γ(α²),
//                 N the degrees of freedom of the samples, γ(α²) = Σ λ_i/(1 + λ_i) the parameters
//                 that the data fit, λ the eigenvalues of the data's information ÷ that of the
//                 prior of weight α². Needs a noise of known size. χ² scatters by √(2N), so that
//                 for N ≫ n the rule has much of chance in it: half of all right models are met too
//                 badly for every α², which is no answer, and of the others many are pulled to the
//                 prior by more than their uncertainty. It is for few and noisy data.
// Evidence        The α² that makes the data most probable: the largest marginal likelihood
//                   p(z | α²) = ∫ e^{−J_mismatch} ρ^{α²} dξ/Z(α²),
//                 ρ^{α²}/Z the prior of weight α² (regularization_prior.h), the integral by
//                 Laplace's approximation about ξ̂,
//                   log p = −J(ξ̂) − log Z + (n/2) log 2π − ½ log det H(ξ̂),
//                 H the second derivative of J, in each direction at least the inverse of the
//                 variance of the prior of weight α²: a flat direction is not wider than the prior.
//                 Where a parameter i is left to the prior the approximation errs as it does of Z_i
//                 itself: by the share 1 − γ_i of it that the data do not fit, log Z_i is taken by
//                 the same approximation, so that data that say nothing prefer no α².
//                 Exact for linear outputs and normal priors. An answer is a maximum inside of the
//                 range from which log p falls by ½ to either end (one standard deviation of log
//                 α²). Uniform priors have no weight: with no others the evidence is flat.
//
// Sources: V. A. Morozov, Methods for Solving Incorrectly Posed Problems (1984), discrepancy;
// D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992), evidence and γ.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/bayes/cost.h"

namespace polyest {

// The minimum of J for one α².
struct RegularizedMinimum {
  double regularization = 1;  // α² > 0
  Vector point;               // n, local coordinates η
  CostValue cost;
  double effective_parameters = 0;  // γ, 0 … n
  double log_evidence = 0;          // log p(z | α²), up to a constant of the data
  bool converged = true;
};

// Of a minimum at η of a cost with α² > 0. None where the curvature there is no finite number.
std::optional<RegularizedMinimum> DescribeMinimum(const Cost& cost, const ConstVectorRef& eta);

// The minimum for an α²; none where there is none to be trusted.
using MinimumAt = std::function<std::optional<RegularizedMinimum>(double regularization)>;

// The minima for each of `values` (ascending, > 0) that has one, from the largest down, so that
// each is near the one before and the first near the prior's most likely value.
std::vector<RegularizedMinimum> SweepRegularization(const Vector& values, const MinimumAt& minimum);

// `count` ≥ 1 values from lowest to highest, even in their logarithms.
Vector LogarithmicRange(double lowest, double highest, int count);

// The 33 values that the rules look at.
Vector RangeOfChoice();

struct RegularizationChoice {
  bool determined = false;
  double regularization = 1;  // 1 where it is not determined
  std::string reason;         // why it is not, or empty
};

// `points`: the sweep over RangeOfChoice(). What lies between two of its values is found to a
// relative 10⁻⁴ or better. degrees: N.
RegularizationChoice ChooseByDiscrepancy(const std::vector<RegularizedMinimum>& points,
                                         const MinimumAt& minimum, double degrees);
RegularizationChoice ChooseByEvidence(const std::vector<RegularizedMinimum>& points,
                                      const MinimumAt& minimum);

}  // namespace polyest
