#pragma once

// Reads and changes the table of the nodes that share a database.

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "server/journal/postgres_pool.h"
#include "server/journal/session_journal.h"

// The length of a node's lease, for statements; the same as kLease.
#define POLYEST_LEASE "interval '3 s'"

namespace polyest::internal {

inline constexpr std::chrono::seconds kLease{3};

// Do what SharedJournal's Nodes and DrainNode do.
absl::StatusOr<std::vector<JournalNode>> ReadNodes(PostgresPool& pool);
absl::Status MarkDraining(PostgresPool& pool, int64_t node);

// Returns the address of the node with the fewest sessions that may take those of `node`; empty if
// there is none.
absl::StatusOr<std::string> FindTaker(PostgresPool& pool, int64_t node);

}  // namespace polyest::internal
