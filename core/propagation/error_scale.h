#pragma once

// The norm in which a local error e of a block of trajectories is measured, worst point first,
//
//   ‖e‖ = max over points p of max over states s of |e_ps| / (rtol · S_ps + atol),
//
// so ‖e‖ ≤ 1 means |e_ps| ≤ rtol · S_ps + atol for every state of every point. The scale S_ps is
// the largest magnitude that state s of point p has had so far, but at least a thousandth of the
// largest of any point of the block: a point that stays near zero while others move is not resolved
// down to its rounding errors. atol = 1e-14 in SI units has the same effect for a block at rest.
//
// A solver asks for its weights at the beginning of a step. A state that starts from 0 would then
// have a scale of 0 through the whole step, so the norm also counts the magnitudes in the states
// at which the right-hand side was evaluated last: at the end of the step under test for
// Dormand–Prince (its last stage) and for BDF (its corrector).

#include <Eigen/Core>

#include "core/common/types.h"

namespace polyest::internal {

class ErrorScale {
 public:
  static constexpr double kAbsoluteTolerance = 1e-14;
  static constexpr double kBlockShare = 1e-3;
  // Replaces a norm that is not finite: the step is rejected, yet the norm stays a number.
  static constexpr double kHuge = 1e100;

  ErrorScale(Eigen::Index points, Eigen::Index states, double relative_tolerance);

  // Raises S to the magnitudes of these states, which a step has accepted.
  void Grow(const Eigen::ArrayXXd& states);
  // 1 / (rtol · S_ps + atol).
  const Eigen::ArrayXXd& weights() const { return weights_; }
  // Returns the largest magnitude that the state has had over the block.
  double block_scale(Eigen::Index state) const { return block_scale_(state); }

  // Sets the states at which the right-hand side was evaluated last; they must stay alive until the
  // next call.
  void Watch(const Eigen::ArrayXXd* states) { watched_ = states; }

  // Returns ‖error‖, with kHuge for a point that is not finite, and stores each point's norm.
  double Norm(const Eigen::ArrayXXd& error, const Eigen::ArrayXXd& weights);
  // Returns the point that was not finite at one of the last few calls of Norm, because a solver
  // that approaches the end of a point's domain alternates tiny accepted steps with longer rejected
  // ones. If there is none, returns the point with the largest norm at the last call.
  Eigen::Index worst_point() const;

 private:
  double WeightedNorm(const Eigen::ArrayXXd& error, const Eigen::ArrayXXd& weights);
  double GrowingNorm(const Eigen::ArrayXXd& error);
  double LargestOf(double norm);

  double relative_tolerance_;
  Eigen::ArrayXXd largest_;  // own magnitude so far
  Eigen::ArrayXXd scale_;    // rtol · S + atol
  Eigen::ArrayXXd weights_;  // 1 / scale_
  Vector block_scale_;
  Eigen::ArrayXd point_norm_;
  Eigen::Index not_finite_point_ = -1;
  int norms_since_not_finite_ = 0;
  const Eigen::ArrayXXd* watched_ = nullptr;
};

}  // namespace polyest::internal
