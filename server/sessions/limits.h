#pragma once

// How much of the machine sessions may take; past a limit the answer is RESOURCE_EXHAUSTED and
// names it.

#include <cstdint>

namespace polyest {

struct SessionLimits {
  int64_t sessions = 10'000;             // --max-sessions: of all tenants
  int64_t sessions_per_tenant = 10'000;  // --max-sessions-per-tenant
  int64_t batch_rows = 1'000'000;        // --max-batch-rows
  int64_t rows = 100'000'000;            // --max-session-rows: of one session
};

}  // namespace polyest
