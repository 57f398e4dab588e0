#pragma once

// What drives the points of a block of trajectories,
//
//   u_pi(t) = amplitude_pi · shape_i(t − delay_pi) + offset_pi,
//
// and the times at which an integrator must stop because of it. It stops at every jump. At a corner
// (the end of a bump, a knot of a linear table) it stops when all points meet it at the same time;
// with delays of their own that would mean as many stops as there are points, and the error control
// sees to it instead.
//
// A jump at t* is met with its left limit up to t* and with its value from the right from there on:
// until Pass(t*), shapes are evaluated no later than just before their break, and after it no
// earlier than at the break, whatever the rounding of t − delay is.

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "core/propagation/trajectory_ensemble.h"

namespace polyest {

class BlockInputs {
 public:
  struct Break {
    double time_s = std::numeric_limits<double>::infinity();
    bool jumps = false;
  };

  // Row r is driven as point points[r] of the specification is. `signals` must outlive it.
  BlockInputs(const EnsembleSpecification& specification, const InputSignals* signals,
              const std::vector<int>& points);

  // The first break that has not been passed.
  Break NextBreak();
  // Breaks up to and including time_s are behind.
  void Pass(double time_s);
  // Rows × inputs, valid until the next call; time_s no earlier than the last break passed and no
  // later than the next one.
  const Eigen::ArrayXXd& At(double time_s);
  // From now on row `to` is driven as row `from` is.
  void CopyRow(Eigen::Index from, Eigen::Index to);

 private:
  // In the signal's own time t − delay: the last break passed and the next one.
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

}  // namespace polyest
