#pragma once

#include <algorithm>
#include <vector>

#include "polyest/types.h"

namespace polyest::internal {

// Returns the point that each row of a new block of trajectories carries: 0 … points − 1, followed
// by copies of the last one up to a multiple of kLanes.
inline std::vector<int> PaddedRows(int points) {
  std::vector<int> rows;
  for (int row = 0; row < points || row % kLanes != 0; ++row) {
    rows.push_back(std::min(row, points - 1));
  }
  return rows;
}

}  // namespace polyest::internal
