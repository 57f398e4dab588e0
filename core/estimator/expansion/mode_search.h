#pragma once

// Where the posterior is, before anything is drawn from it: the minima of the cost, and the
// Gaussians at them, as far as these can be trusted (guarded_importance.h says when).
//
// Minima are searched from starts spread over the best points of a cover of the box and of the
// guesses. Where there are several, others are searched from more points of the cover and from the
// fourth corners of parallelograms of three of them, where those of a posterior that is a product
// would be, until two searches in turn find none.

#include <optional>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/differential_evolution.h"
#include "core/bayes/minimizer.h"
#include "core/bayes/mixture_importance.h"
#include "core/estimator/expansion/expansion_design.h"
#include "polyest/stop.h"

namespace polyest::internal {

// All points and modes are in local coordinates of the design. On a stop request a search ends
// early, and what it has found is incomplete.
class ModeSearch {
 public:
  // Computes the cost at the cover and the guesses (any number × n), and the minima found from the
  // best of them. What is passed must outlive the object.
  ModeSearch(const Cost& cost, const ExpansionDesign& design, const Matrix& guesses,
             const Stop& stop);

  // The box of the sampler (n).
  const Vector& lower() const { return lower_; }
  const Vector& upper() const { return upper_; }
  // Returns the distinct minima found so far, lowest first.
  const std::vector<Minimum>& minima() const { return minima_; }
  // Returns the number of minima that matter: the first so many.
  size_t CountOfMinima() const;

  // Returns L (n × n) of H = L Lᵀ at the minimum if it is the only one that matters and the
  // curvature's Gaussian there may approximate the posterior, else nothing.
  std::optional<Matrix> FactorOfOnlyMode() const;
  // Searches further minima. Returns a Gaussian for each one that matters and, at the end, one
  // around all of them; nothing if the curvature does not give one, or if a part of what matters is
  // out of their reach.
  std::optional<std::vector<GaussianMode>> FindModes();
  // Whether the Gaussians reach all points of the cover that matter, and of the guesses all but
  // this part (0 to 1).
  bool Reach(const std::vector<GaussianMode>& modes, double part) const;

 private:
  void Look();
  Matrix BestOf(Eigen::Index first, Eigen::Index count, int starts, Eigen::Index max_best) const;
  double NegligibleFrom() const;
  bool FindsOthers(const Matrix& starts);
  void FindMore();
  Matrix Corners() const;
  bool IsKnown(const Vector& point, size_t count) const;
  std::optional<std::vector<GaussianMode>> Modes() const;
  std::optional<Matrix> FactorAt(const Vector& eta) const;
  bool OnBound(const Vector& eta) const;
  std::vector<Eigen::Index> PointsBeyond(const std::vector<GaussianMode>& modes) const;

  const Cost& cost_;
  const Matrix& guesses_;
  const Stop& stop_;
  const MinimizationProblem search_;
  Vector lower_, upper_;
  Particles known_;         // the cover, then the guesses
  Eigen::Index cover_ = 0;  // number of points of the cover
  std::vector<Minimum> minima_;
};

}  // namespace polyest::internal
