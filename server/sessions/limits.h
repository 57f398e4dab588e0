#pragma once

// Limits how much of the machine sessions may use. Past a limit the answer is RESOURCE_EXHAUSTED
// and names the limit.

#include <cstdint>

#include "proto/wire/convert/problem_limits.h"

namespace polyest::internal {

struct SessionLimits {
  int64_t sessions = 10'000;                // --max-sessions: of all tenants
  int64_t sessions_per_tenant = 10'000;     // --max-sessions-per-tenant
  int64_t batch_rows = 1'000'000;           // --max-batch-rows
  int64_t rows = 100'000'000;               // --max-session-rows: of one session
  int64_t rows_per_tenant = 1'000'000'000;  // --max-tenant-rows: of all sessions of a tenant
  int64_t total_rows = 10'000'000'000;      // --max-total-rows: of all sessions of all tenants
  int64_t disk_mb_per_tenant = 0;           // --max-tenant-disk-mb, MiB of its sessions; 0: none
  int64_t memory_mb_per_tenant = 0;  // --max-tenant-memory-mb, MiB of loaded sessions; 0: none
  // Limits of a problem that comes with a request, for a session or without one. Sessions that
  // exist already stay, whatever the limits are now.
  ProblemLimits problem{.parameters = 64, .states = 1'000};
};

}  // namespace polyest::internal
