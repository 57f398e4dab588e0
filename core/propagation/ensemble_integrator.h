#pragma once

// The seam behind which an integrator lives: ERKStep, CVODE, and whatever comes later with these
// as its oracles.

#include "core/common/types.h"

namespace polyest {

// The right-hand side of a block of trajectories, points × states.
class EnsembleSystem {
 public:
  virtual ~EnsembleSystem() = default;
  virtual Eigen::Index points() const = 0;  // a multiple of kLanes
  virtual Eigen::Index states() const = 0;
  virtual void Derivatives(double time_s, const ConstBlock& states, Block derivatives) = 0;
  // ∂f_i/∂x_s in column s·states() + i, if it is known exactly; otherwise false and nothing is
  // written.
  virtual bool StateJacobian(double /*time_s*/, const ConstBlock& /*states*/, Block /*jacobian*/) {
    return false;
  }
};

struct IntegratorOutcome {
  bool ok = true;
  int flag = 0;             // the solver's own return code
  const char* reason = "";  // that code in words
  // The steps allowed to one call are used up; the next call goes on from there.
  bool too_many_steps = false;
  Eigen::Index worst_point = 0;  // the row whose error or value made it fail
};

class EnsembleIntegrator {
 public:
  virtual ~EnsembleIntegrator() = default;

  // After a call that was not OK, the time of the last good step and the states there; otherwise
  // the time of the last call and its states.
  virtual double time_s() const = 0;
  virtual ConstBlock states() const = 0;

  // Integrates until time_s is covered, never stepping past stop_time_s (≥ time_s, +∞ for no
  // limit), and writes the states at time_s by dense output. time_s may equal the time of the
  // previous call. Takes at most most_steps steps.
  virtual IntegratorOutcome AdvanceTo(double time_s, double stop_time_s, int most_steps,
                                      Block states) = 0;

  // The right-hand side changes abruptly at the present time, which must be a stop time reached:
  // forget what was kept from before it.
  virtual void Restart() = 0;

  // Whether the steps of late were held down by stability instead of accuracy, so that a method for
  // stiff systems would do better.
  virtual bool LooksStiff() { return false; }
};

}  // namespace polyest
