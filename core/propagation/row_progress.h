#pragma once

// How far one row of a block has come that takes steps of its own and locates its switchings
// (switching_integrator.h).

#include "core/common/types.h"

namespace polyest::internal {

struct RowProgress {
  // The last step taken, which ends at end_s.
  double begin_s = 0;
  double end_s = 0;
  double length_s = 0;  // 0 before the first step
  double next_s = 0;    // length of the next step

  // The step on trial.
  double trial_s = 0;  // 0 for a row that rests
  bool hits_stop = false;
  int rejections_by_look = 0;  // in succession

  // The switching that is being located, if any.
  bool locating = false;
  Eigen::Index which = 0;
  bool upwards = false;
  int secants = 0;
  double full_s = 0;        // the step that went too far
  double before_s = 0;      // an earlier trial …
  double before_value = 0;  // … and the function there
  double slope = 0;         // of the function over the step's length, for the first secant

  int switchings = 0;  // since the last sample
  int stalled = 0;     // switchings in succession without progress
  double switched_s = -kInfinity;
  int stiff_steps = 0;
  int steps = 0;
};

}  // namespace polyest::internal
