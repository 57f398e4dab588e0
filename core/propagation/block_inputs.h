#pragma once

// The inputs that drive the points of a block of trajectories,
//
//   u_pi(t) = amplitude_pi · shape_i(t − delay_pi) + offset_pi,
//
// and the times at which an integrator must stop because of them. It stops at every jump. At a
// corner (the end of a bump, a knot of a linear table) it stops if all points meet it at the same
// time. If the points have different delays there would be as many stops as points, so corners are
// left to the error control.
//
// At a jump at t* the input has its left limit up to t* and its right limit from there on. Until
// Pass(t*), shapes are evaluated no later than just before their break, and after it no earlier
// than at the break, whatever the rounding of t − delay.

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

class BlockInputs {
 public:
  struct Break {
    double time_s = std::numeric_limits<double>::infinity();
    bool jumps = false;
  };

  // Drives row r as point points[r] of the specification. `signals` must outlive the object.
  BlockInputs(const EnsembleSpecification& specification, const InputSignals* signals,
              const std::vector<int>& points);

  // Returns the first break that has not been passed.
  Break NextBreak();
  // Passes all breaks up to and including `time_s`.
  void Pass(double time_s);
  // Returns the inputs (rows × inputs) at `time_s`, valid until the next call. `time_s` must not
  // lie before the last break passed or after the next one.
  const Eigen::ArrayXXd& At(double time_s);
  // Drives row `to` as row `from` from now on.
  void CopyRow(Eigen::Index from, Eigen::Index to);

 private:
  // The last break passed and the next one, in the signal's own time t − delay.
  struct Cursor {
    double delay_s = 0;
    double last_s = 0;
    double next_s = std::numeric_limits<double>::infinity();
  };

  bool Stops(size_t input) const;
  double Shape(size_t input, const Cursor& cursor, double time_s) const;

  const InputSignals* signals_;
  Eigen::ArrayXXd amplitudes_;
  Eigen::ArrayXXd offsets_;                   // rows × inputs, or empty
  std::vector<std::vector<Cursor>> cursors_;  // by input: one, or one a row where delays differ
  Eigen::ArrayXXd values_;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();  // of values_
};

}  // namespace polyest::internal
