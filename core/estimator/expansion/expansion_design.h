#pragma once

// Where an expansion interpolates and at which points: the whole prior with the germs' own
// polynomials (the paper's expansion), or a box moved to the posterior with Legendre polynomials.

#include <absl/status/statusor.h>

#include <memory>
#include <utility>

#include "core/bayes/posterior.h"
#include "core/bayes/region.h"
#include "core/chaos/basis.h"
#include "core/common/types.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

struct ExpansionDesign {
  Region region = Region::WholePrior(1);
  std::shared_ptr<const Basis> basis;  // in local coordinates η
  Matrix points;                       // Q × n, collocation points, local
  // C × n, local: where the expansion is compared with the model itself, and −log of the density
  // they were drawn from, up to a constant, so that they can be reweighted as the posterior
  // narrows.
  Matrix check_points;
  Vector check_costs;
  Vector reference;     // η_0 of the mismatch sums
  Vector lower, upper;  // the box (n) in which the expansion is trusted, local
  bool whole_prior = true;
};

// Fraction of the trusted box beyond which a particle counts as lying at its edge, and how far
// past the edge particles may go, so that a posterior that leans out is seen to do so.
inline constexpr double kEdge = 0.97;
inline constexpr double kOvershoot = 1.15;

// As many as there are parameters and some more.
int CheckCount(int dimension);
// Where an expansion in this germ is trusted: between its bounds; where it has none, between its
// 0.1 % and 99.9 % quantiles.
std::pair<double, double> TrustedRange(const Germ& germ);

// The paper's expansion: germs' polynomials, points through the germs' quantile functions.
absl::StatusOr<ExpansionDesign> DesignForPrior(const ResolvedProblem& problem);

// An expansion over `region`, η ∈ [−1, 1]^n. Collocation points outside Ω are drawn towards
// `inside` (a point of Ω in germ coordinates) until they lie in it.
ExpansionDesign DesignForRegion(const ResolvedProblem& problem, const Truncation& truncation,
                                Region region, const Vector& inside);

// The box that holds the particles (germ coordinates, W × n) along their principal axes, widened
// by a margin of about a third.
Region RegionOfParticles(const Matrix& xis);

// The design's trusted box in germ space as a region, with η ∈ [−1, 1]^n.
Region TrustedRegion(const ExpansionDesign& design);

// The box particles are confined to: the trusted box with its overshoot.
void SamplingBox(const ExpansionDesign& design, Vector& lower, Vector& upper);

// The axes (of the trusted region) at whose edge more than 1 % of the particles (local, W × n)
// lie although Ω goes on beyond it.
std::vector<int> LeaningAxes(const ExpansionDesign& design, const Prior& prior, const Matrix& etas);

// The trusted region widened by half along `axes` and shifted towards the particles (local).
Region WidenedRegion(const ExpansionDesign& design, const Matrix& etas,
                     const std::vector<int>& axes);

}  // namespace polyest::internal
