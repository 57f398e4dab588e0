#pragma once

// The state of a mixture component between two rows as plain data. The fields are those of
// MixtureComponent.

#include <cstdint>
#include <optional>

#include "core/estimator/expansion/expansion_state.h"
#include "core/estimator/expansion/reexpansion_memory.h"
#include "core/estimator/expansion/replay_allowance.h"
#include "core/estimator/posterior/reexpansion_schedule.h"
#include "core/estimator/record/record_summary.h"

namespace polyest::internal {

struct ComponentState {
  int runs = 1;  // runs of the component's problem
  std::optional<EndedRuns> ended_runs;
  double relative_tolerance = 0;  // of the problem's integrators; it follows the noise
  ExpansionState expansion;
  Matrix particles;
  ReexpansionMemory memory;
  double weight = 1;
  int room = 1;
  bool bisected = false;
  int64_t taken = 0;
  ReexpansionSchedule::State schedule;
  uint64_t reexpansions_tried = 0;
  int reexpansions = 0;
  int64_t abandoned_rows = 0;
  ReplayAllowance::State allowance;
  Postponed postponed;
  RecordSummary summary;
};

}  // namespace polyest::internal
