#pragma once

// The norm in which a local error e of a block of trajectories is measured, worst point first,
//
//   ‖e‖ = max over points p of max over states s of |e_ps| / (rtol · S_ps + floor_s),
//
// so ‖e‖ ≤ 1 means |e_ps| ≤ rtol · S_ps + floor_s for every state of every point. The scale S_ps is
// the largest magnitude that state s of point p has had so far, but at least a thousandth of the
// largest of any point of the block: a point that stays near zero while others move is not resolved
// down to its rounding errors. Nothing here depends on units.
//
// The floor is for two kinds of states. One has been exactly 0 in the whole block so far. While it
// begins to move, its own magnitude is no measure of its errors, so it has the floor rtol · 1e-6
// P_s, where P_s is the size that it is expected to reach by the next sample. The other stays near
// zero because what moves it cancels (the roll of a car on a level road). Its magnitude may be
// nothing but rounding errors. Those of a step are about ε h R_s, where R_s is the size of the
// terms of f_s:
//
//   R_s = max over points of |f_s(x)| + |f_s(x + √ε S) − f_s(x)| / √ε.
//
// Hence floor_s = 100 ε h R_s, h the present step, where S_s < 1e-10 · h R_s in the whole block; 0
// elsewhere.
//
// A solver asks for its weights at the beginning of a step. A state that starts from 0 would then
// have a scale of 0 through the whole step, so the norm also counts the magnitudes in the states
// that the solver watches: those at the end of the step under test, for BDF as its corrector has
// evaluated them last.

#include <Eigen/Core>

#include "core/common/types.h"

namespace polyest::internal {

class ErrorScale {
 public:
  static constexpr double kBlockShare = 1e-3;
  // Replaces a norm that is not finite: the step is rejected, yet the norm stays a number.
  static constexpr double kHuge = 1e100;

  ErrorScale(Eigen::Index points, Eigen::Index states, double relative_tolerance);

  // Raises S to the magnitudes of these states, which a step has accepted.
  void Grow(const Eigen::ArrayXXd& states);
  // 1 / (rtol · S_ps + floor_s).
  const Eigen::ArrayXXd& weights() const { return weights_; }
  // Returns the largest magnitude that the state has had over the block.
  double block_scale(Eigen::Index state) const { return block_scale_(state); }
  // Sets the floors for the present h R_s and P_s, one of each for each state.
  void SetFloors(const Vector& largest_changes, const Vector& expected_sizes);
  // Demands new floors, because the right-hand side has changed abruptly.
  void ForgetFloors() { block_scale_at_floors_.resize(0); }
  // Returns the largest magnitude of a state over the block, or if it has always been 0, the P_s
  // last set; 1 where that is 0 too, since then nothing tells the state's size.
  double SizeOf(Eigen::Index state) const;
  // Whether a state has more than doubled its largest magnitude since SetFloors or was 0 then, or
  // SetFloors was never called.
  bool NeedsFloors() const;

  // Sets the states at the end of the step under test; they must stay alive until the next call.
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
  void SetScale(Eigen::Index state);

  double relative_tolerance_;
  Eigen::ArrayXXd largest_;  // own magnitude so far
  Eigen::ArrayXXd scale_;    // rtol · S + floor, above 0
  Eigen::ArrayXXd weights_;  // 1 / scale_
  Vector block_scale_;
  Vector floor_, expected_;       // expected_ is P_s
  Vector block_scale_at_floors_;  // empty before SetFloors
  Eigen::ArrayXd point_norm_;
  Eigen::Index not_finite_point_ = -1;
  int norms_since_not_finite_ = 0;
  const Eigen::ArrayXXd* watched_ = nullptr;
};

}  // namespace polyest::internal
