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
// An integrator never steps over a whole interval between two knots, even where it does not stop at
// them: StepEnd bounds its steps. An exact stepper, whose inputs must be one polynomial during a
// step, stops at every knot instead (StopAtEveryKnot).
//
// At a jump at t* the input has its left limit up to t* and its right limit from there on. Until
// Pass(t*), shapes are evaluated no later than just before their break, and after it no earlier
// than at the break, whatever the rounding of t − delay.

#include <Eigen/Core>
#include <limits>
#include <span>
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

  // Makes every knot of every input a break, those of smooth curves included. Must be called before
  // any other function, and only if all points meet each knot at the same time.
  void StopAtEveryKnot() { every_knot_ = true; }
  // Returns the first break that has not been passed.
  Break NextBreak();
  // Passes all breaks up to and including `time_s`.
  void Pass(double time_s);
  // Returns the inputs (rows × inputs) at `time_s`, valid until the next call. `time_s` must not
  // lie before the last break passed or after the next one.
  const Eigen::ArrayXXd& At(double time_s);
  // Returns the latest end of a step from `time_s` that skips no interval between two knots of an
  // input that does not stop there; +∞ if there is no such input. Streamed inputs do not count:
  // their knots yet to come must not matter, and an integrator stops at every sample anyway.
  double StepEnd(double time_s) const;
  // Returns the numbers of the inputs that vary (all but ConstantInput).
  std::vector<size_t> Varying() const;
  // Writes the state of an input's generator (input_generator.h) at `time_s`, which is bounded as
  // in At. All points must have the same delay.
  void GeneratorStateOf(size_t input, double time_s, std::span<double> state) const;
  const Eigen::ArrayXXd& amplitudes() const { return amplitudes_; }
  // Rows × inputs, or empty where there are no offsets.
  const Eigen::ArrayXXd& offsets() const { return offsets_; }
  Eigen::Index channels() const { return amplitudes_.cols(); }
  // Returns one row's input at a time of its own, with the same limits.
  double At(Eigen::Index row, Eigen::Index input, double time_s) const;
  // Drives row `to` as row `from` from now on.
  void CopyRow(Eigen::Index from, Eigen::Index to);

 private:
  // A place in a signal, in the signal's own time t − delay.
  struct Cursor {
    double delay_s = 0;
    bool stops = true;  // whether an integrator stops at the breaks
    double last_s = 0;  // the last break passed
    double next_s = std::numeric_limits<double>::infinity();         // the next one
    double before_next_s = std::numeric_limits<double>::infinity();  // the last time before it
    // The number of knots up to the time of the last evaluation, which the next one is close to.
    mutable size_t knots = 0;
  };

  void FindNext(size_t input, Cursor& cursor) const;
  double BreakAfter(size_t input, double time_s) const;
  // Returns the time in the signal's own time at which to evaluate it for `time_s`.
  static double BoundedTime(const Cursor& cursor, double time_s);
  double Shape(size_t input, const Cursor& cursor, double time_s) const;

  const InputSignals* signals_;
  bool every_knot_ = false;
  Eigen::ArrayXXd amplitudes_;
  Eigen::ArrayXXd offsets_;                   // rows × inputs, or empty
  std::vector<std::vector<Cursor>> cursors_;  // by input: one, or one a row where delays differ
  Eigen::ArrayXXd values_;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();  // of values_
};

}  // namespace polyest::internal
