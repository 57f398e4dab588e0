#pragma once

// The region in which an expansion interpolates and its collocation points. The region is either
// the whole prior, with the polynomials of the germs (the paper's expansion), or a box moved to the
// posterior, with Legendre polynomials.

#include <absl/status/statusor.h>

#include <memory>
#include <utility>

#include "core/bayes/element.h"
#include "core/bayes/posterior.h"
#include "core/bayes/region.h"
#include "core/chaos/basis.h"
#include "core/common/types.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

struct ExpansionDesign {
  Region region = Region::WholePrior(1);
  std::shared_ptr<const Basis> basis;  // in local coordinates η
  Matrix points;                       // Q × n collocation points, local coordinates
  // Check points (C × n, local coordinates), where the expansion is compared with the model itself,
  // and the negative log density from which they were drawn, up to a constant. The latter allows
  // reweighting them as the posterior narrows.
  Matrix check_points;
  Vector check_costs;
  // Whether the check points are draws of a posterior. Those that cover the prior or the region are
  // too few to speak for a posterior that is much narrower.
  bool checks_are_draws = false;
  Vector reference;         // η_0, the reference of the mismatch sums
  Vector lower, upper;      // the trusted box (n), local coordinates
  bool whole_prior = true;  // whether the basis is orthonormal with the prior as weight
  bool in_tails = false;    // whether it is that of DesignForTails
  Element element;          // the part of Ω whose posterior this expansion represents

  // Of the trusted box (n each).
  Vector Middle() const { return 0.5 * (lower + upper); }
  Vector HalfWidths() const { return 0.5 * (upper - lower); }
};

// Fraction of the trusted box beyond which a particle counts as lying at its edge, and how far
// beyond the box particles may go, as a factor of its half width. The overshoot makes a posterior
// that extends beyond the box visible.
inline constexpr double kEdge = 0.97;
inline constexpr double kOvershoot = 1.15;
// Factor of the half width at which Ω is looked for beyond an edge.
inline constexpr double kBeyondEdge = 1.12;

// Returns the number of check points that cover the prior or a region: the dimension plus 3.
int CheckCount(int dimension);
// Makes the first of these draws of a posterior (W × n, germ coordinates) the check points; `costs`
// are the negative logarithms of their density. Such check points also correct the posterior
// (posterior/model_correction.h), so that there are up to a sixth as many as collocation points, at
// most 200, and not fewer than CheckCount if there are as many draws.
void SetDrawnChecks(const ConstMatrixRef& xis, const ConstVectorRef& costs,
                    ExpansionDesign& design);
// Returns the range in which an expansion in this germ is trusted: between its bounds, or its 0.1 %
// and 99.9 % quantiles where it has none.
std::pair<double, double> TrustedRange(const Germ& germ);

// Returns the design of the paper's expansion: the germs' polynomials, and points mapped by the
// germs' quantile functions. Returns FailedPrecondition or ResourceExhausted if the collocation
// points cannot be made. The truncation is the first one, or the one given.
absl::StatusOr<ExpansionDesign> DesignForPrior(const ResolvedProblem& problem);
absl::StatusOr<ExpansionDesign> DesignForPrior(const ResolvedProblem& problem,
                                               const Truncation& truncation);
// Returns the design of an expansion over the prior and its tails, to the 10⁻⁶ quantiles: Legendre
// polynomials, which follow the model there as well as where the prior is dense.
ExpansionDesign DesignForTails(const ResolvedProblem& problem);
// Whether estimates begin with DesignForTails: those of one or two parameters that are not all
// uniform, where that costs little and no mode of the posterior in the prior's tails is lost.
bool BeginsInTails(const ResolvedProblem& problem);
// Returns the design with which estimates begin: DesignForTails where they do so, or where
// `in_tails` asks for it, else DesignForPrior.
absl::StatusOr<ExpansionDesign> DesignToBeginWith(const ResolvedProblem& problem,
                                                  bool in_tails = false);
// The mean and the covariance of the basis' polynomials under the prior, S and S × S.
struct PriorMoments {
  Vector mean;
  Matrix covariance;
};
// Returns them for a design in the tails, whose basis is not orthonormal there.
PriorMoments MomentsUnderPrior(const Prior& prior, const ExpansionDesign& design);

// Returns a design over `region`, η ∈ [−1, 1]^n. Collocation points outside Ω are moved towards
// `inside`, a point of Ω in germ coordinates, until they lie in Ω. The design has no check points.
ExpansionDesign DesignForRegion(const ResolvedProblem& problem, const Truncation& truncation,
                                Region region, const Vector& inside);

// Adds check points that are spread evenly over the design's region, as draws of a uniform density.
// Those outside Ω are moved as collocation points are.
void SpreadCheckPoints(const ResolvedProblem& problem, const Vector& inside,
                       ExpansionDesign& design);

// Returns the point of Ω that is nearest to ξ, germ by germ, and a little off its bounds.
Vector NearestInside(const Prior& prior, const Vector& xi);
// Returns the region's centre or, in germs in which Ω cuts the region, the middle of what they have
// in common. Points of the region that are moved inside stay apart when they are moved towards it;
// towards a point at a bound they would fall together.
Vector MiddleInside(const Prior& prior, const Region& region);

// Returns the box along the particles' principal axes that contains them, widened by a margin of
// about a third. The particles are W × n, in germ coordinates.
Region RegionOfParticles(const Matrix& xis);

// Returns the design's trusted box as a region in germ space, with η ∈ [−1, 1]^n.
Region TrustedRegion(const ExpansionDesign& design);

// Sets the box to which particles are confined: the trusted box with its overshoot.
void SamplingBox(const ExpansionDesign& design, Vector& lower, Vector& upper);

// Returns the axes of the trusted region at whose edge more than this fraction of the particles (W
// × n, local coordinates) lie although Ω and `element` extend beyond it.
inline constexpr double kLeaningFraction = 0.01;
std::vector<int> LeaningAxes(const ExpansionDesign& design, const Prior& prior,
                             const Element& element, const Matrix& etas,
                             double fraction = kLeaningFraction);
// Returns the part of an element in which the ended runs are known: within the box that their terms
// cover (ended_runs.h), with the overshoot. Beyond it their polynomials say nothing.
Element WithinKnown(const ResolvedProblem& problem, const Element& element);

// Returns the trusted region, `factor` times as wide along `axes` and shifted along them to the
// particles' mean (particles in local coordinates).
Region WidenedRegion(const ExpansionDesign& design, const Matrix& etas,
                     const std::vector<int>& axes, double factor);

}  // namespace polyest::internal
