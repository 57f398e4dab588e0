#pragma once

// A minimization problem scaled for the solver. The variable is u = (x − lower)/(upper − lower), so
// that the box is the unit cube; constraint rows have unit length, and the function is divided by a
// scale.

#include "core/bayes/minimizer.h"
#include "core/common/types.h"
#include "polyest/stop.h"

namespace polyest::internal {

class UnitProblem {
 public:
  // The tolerance, in units of the cube, within which a constraint is active or satisfied.
  static constexpr double kActive = 1e-10;

  // `problem` and `stop` must outlive the object. A variable whose bounds are equal stays at 0.
  UnitProblem(const MinimizationProblem& problem, const Stop& stop);

  // The constraints are rows u ≤ bounds.
  const Matrix& rows() const { return rows_; }
  const Vector& bounds() const { return bounds_; }
  double function_scale() const { return function_scale_; }
  void set_function_scale(double scale) { function_scale_ = scale; }
  int evaluations() const { return evaluations_; }
  bool stopped() const { return stopped_; }
  bool PollStop() { return stopped_ = stopped_ || !stop_.Check().ok(); }

  // Returns a point that is never outside the original bounds, despite rounding.
  Vector ToPoint(const Vector& u) const;
  Vector ToUnit(const Vector& x) const;

  // Returns the scaled value and fills `gradient` unless it is null; +∞ and 0 if either is not
  // finite.
  double Value(const Vector& u, Vector* gradient);

  // Returns the nearest point in the cube and the constraints, by Dykstra's alternating
  // projections.
  Vector Project(Vector u) const;

 private:
  double MaxViolated(const Vector& u) const;

  const MinimizationProblem& problem_;
  const Stop& stop_;
  Vector width_;
  Matrix rows_;
  Vector bounds_;
  double function_scale_ = 1;
  int evaluations_ = 0;
  bool stopped_ = false;
};

}  // namespace polyest::internal
