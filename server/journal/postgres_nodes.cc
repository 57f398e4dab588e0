#include "server/journal/postgres_nodes.h"

#include <absl/strings/str_format.h>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr char kNodes[] =
    "SELECT node, address, (SELECT count(*) FROM owner WHERE owner.node = node.node), streams, "
    "busy_cores, extract(epoch FROM clock_timestamp() - lease_until + " POLYEST_LEASE
    ")::double precision, "
    "draining, lease_until > clock_timestamp() FROM node WHERE lease_until > clock_timestamp() OR "
    "EXISTS (SELECT 1 FROM owner WHERE "
    "owner.node = node.node) ORDER BY node";
constexpr char kTaker[] =
    "SELECT address FROM node WHERE node <> $1 AND NOT draining AND address <> '' AND lease_until "
    "> "
    "clock_timestamp() ORDER BY (SELECT count(*) FROM owner WHERE owner.node = node.node), node "
    "LIMIT 1";
constexpr char kDrain[] =
    "UPDATE node SET draining = true WHERE node = $1 AND lease_until > clock_timestamp()";

}  // namespace

absl::StatusOr<std::vector<JournalNode>> ReadNodes(PostgresPool& pool) {
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult result, pool.Query(kNodes));
  std::vector<JournalNode> nodes;
  for (int row = 0; row < result.rows(); ++row) {
    nodes.push_back({.number = result.Integer(row, 0),
                     .address = result.Bytes(row, 1),
                     .sessions = result.Integer(row, 2),
                     .streams = result.Integer(row, 3),
                     .busy_cores = result.Real(row, 4),
                     .lease_age_s = result.Real(row, 5),
                     .draining = result.Flag(row, 6),
                     .alive = result.Flag(row, 7)});
  }
  return nodes;
}

absl::StatusOr<std::string> FindTaker(PostgresPool& pool, int64_t node) {
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult taker,
                           pool.Query(kTaker, PostgresParameters().Add(node)));
  return taker.rows() == 0 ? std::string() : taker.Bytes(0, 0);
}

absl::Status MarkDraining(PostgresPool& pool, int64_t node) {
  POLYEST_ASSIGN_OR_RETURN(const std::string taker, FindTaker(pool, node));
  if (taker.empty()) {
    return absl::FailedPreconditionError(
        absl::StrFormat("there is no other node that could take the sessions of nodes/%d", node));
  }
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult drained,
                           pool.Query(kDrain, PostgresParameters().Add(node)));
  if (drained.changes() > 0) return absl::OkStatus();
  return absl::NotFoundError(absl::StrFormat("there is no node \"nodes/%d\" that lives", node));
}

}  // namespace polyest::internal
