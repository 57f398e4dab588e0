#pragma once

// The interface of an integrator of a block of trajectories.

#include <algorithm>
#include <cmath>

#include "core/common/types.h"

namespace polyest::internal {

// The right-hand side of a block of trajectories, points × states.
class BlockSystem {
 public:
  virtual ~BlockSystem() = default;
  virtual Eigen::Index points() const = 0;  // a multiple of kLanes
  virtual Eigen::Index states() const = 0;
  virtual void Derivatives(double time_s, const ConstBlock& states, Block derivatives) = 0;
  // Writes ∂f_i/∂x_s into column s·states() + i if it is known exactly; otherwise returns false and
  // writes nothing.
  virtual bool StateJacobian(double /*time_s*/, const ConstBlock& /*states*/, Block /*jacobian*/) {
    return false;
  }
};

struct IntegratorOutcome {
  bool ok = true;
  int flag = 0;             // the solver's own return code
  const char* reason = "";  // that code in words
  // Whether the call has used all steps that it may take; the next call goes on from there.
  bool too_many_steps = false;
  Eigen::Index worst_point = 0;  // the row whose error or value made it fail
};

// Whether steps that covered `advance_s` up to `time_s`, towards a sample in `span_s`, got nowhere,
// so that more of them will not help.
inline bool StandsStill(double advance_s, double time_s, double span_s) {
  return !(advance_s > 1e-13 * std::max(std::abs(time_s), span_s));
}
inline constexpr char kStandstillReason[] = "the step size fell below the resolution of time";

class BlockIntegrator {
 public:
  virtual ~BlockIntegrator() = default;

  // The time and the states of the last call, or after a failure those of the last good step.
  virtual double time_s() const = 0;
  virtual ConstBlock states() const = 0;

  // Integrates until `time_s` is covered, never stepping past `stop_time_s` (≥ `time_s`, +∞ for no
  // limit), and writes the states at `time_s` by dense output. `time_s` may equal the time of the
  // previous call. Takes at most `max_steps` steps.
  virtual IntegratorOutcome AdvanceTo(double time_s, double stop_time_s, int max_steps,
                                      Block states) = 0;

  // Discards the history of the solver, because the right-hand side changes abruptly at the present
  // time, which must be a stop time that was reached.
  virtual void Restart() = 0;

  // Continues from other states at the present time, which must be a stop time that was reached;
  // returns false and does nothing if a new integrator must be made for that.
  virtual bool RestartFrom(const ConstBlock& /*states*/) { return false; }

  // Returns whether stability and not accuracy has limited the recent steps, so that a method for
  // stiff systems would do better.
  virtual bool LooksStiff() { return false; }

  // Writes the model's outputs at the time and the states of the last call, if they do not follow
  // from these alone; otherwise returns false and writes nothing.
  virtual bool Outputs(double /*time_s*/, const ConstBlock& /*states*/, Block /*outputs*/) {
    return false;
  }
};

}  // namespace polyest::internal
