#pragma once

// The state of a mixture of components between two rows as plain data. The fields are those of
// ComponentMixture.

#include <vector>

#include "core/estimator/posterior/component_state.h"

namespace polyest::internal {

struct MixtureState {
  std::vector<ComponentState> components;  // all at the same row
  int64_t weighing_row = 0;
  double left_out = 0;
  int elements_left_out = 0;
  int reexpansions = 0;
  int64_t propagated_rows = 0;
};

}  // namespace polyest::internal
