#pragma once

// Counts what an observer is told.

#include <vector>

#include "server/sessions/session_observer.h"

namespace polyest::internal {

struct CountingObserver final : SessionObserver {
  void OnEstimate(const SharedEstimate& estimate) override { estimates.push_back(estimate); }
  void OnClosed() override { ++closed; }
  void OnReplaced() override { ++replaced; }
  std::vector<SharedEstimate> estimates;
  int closed = 0;
  int replaced = 0;
};

}  // namespace polyest::internal
