#pragma once

// A minimization problem as the solver likes it: in u = (x − lower)/(upper − lower), where the box
// is the unit cube, with constraint rows of unit length and the function divided by a scale.

#include "core/bayes/minimizer.h"
#include "core/common/stop.h"
#include "core/common/types.h"

namespace polyest {

class UnitProblem {
 public:
  // A constraint is active, or held, to this much of the unit cube.
  static constexpr double kActive = 1e-10;

  // Both must outlive it. A variable whose bounds are equal stays at 0.
  UnitProblem(const MinimizationProblem& problem, const Stop& stop);

  // rows u ≤ bounds.
  const Matrix& rows() const { return rows_; }
  const Vector& bounds() const { return bounds_; }
  double function_scale() const { return function_scale_; }
  void set_function_scale(double scale) { function_scale_ = scale; }
  int evaluations() const { return evaluations_; }
  bool stopped() const { return stopped_; }
  bool PollStop() { return stopped_ = stopped_ || !stop_.Check().ok(); }

  // Never outside the original bounds, whatever the rounding.
  Vector ToPoint(const Vector& u) const;
  Vector ToUnit(const Vector& x) const;

  // Scaled value and gradient; +∞ and 0 where either is not finite. gradient may be null.
  double Value(const Vector& u, Vector* gradient);

  // The nearest point of the cube and the constraints, by Dykstra's alternating projections.
  Vector Project(Vector u) const;

 private:
  double MostViolated(const Vector& u) const;

  const MinimizationProblem& problem_;
  const Stop& stop_;
  Vector width_;
  Matrix rows_;
  Vector bounds_;
  double function_scale_ = 1;
  int evaluations_ = 0;
  bool stopped_ = false;
};

}  // namespace polyest
