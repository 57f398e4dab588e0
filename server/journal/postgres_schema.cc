#include "server/journal/postgres_schema.h"

#include <absl/strings/str_format.h>

#include <iterator>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Migration i turns version i into version i + 1. Migrations that were released are never changed;
// new ones are added behind them.
constexpr const char* kPostgresMigrations[] = {
    // The columns place_* hold the place of the session after the batch, place_bytes the bytes of
    // its measurements up to there. A batch of up to 8 kB
    // stands in the table itself; none is compressed, since measurements hardly shrink.
    R"(CREATE SEQUENCE session_number;
       CREATE TABLE session (
         number bigint PRIMARY KEY,
         tenant text COLLATE "C" NOT NULL,
         name text COLLATE "C" NOT NULL,
         hidden boolean NOT NULL,
         created_s bigint NOT NULL,
         created_ns bigint NOT NULL,
         reorder_window_s double precision NOT NULL,
         problem bytea NOT NULL,
         digest bytea NOT NULL);
       CREATE UNIQUE INDEX session_by_name ON session (tenant, name) WHERE NOT hidden;
       CREATE TABLE batch (
         session bigint NOT NULL,
         sequence bigint NOT NULL,
         measurements bytea NOT NULL,
         digest bytea NOT NULL,
         place_samples bigint NOT NULL,
         place_rows bigint NOT NULL,
         place_run bigint NOT NULL,
         place_time_s double precision NOT NULL,
         place_bytes bigint NOT NULL,
         PRIMARY KEY (session, sequence)) WITH (toast_tuple_target = 8160);
       ALTER TABLE batch ALTER measurements SET STORAGE EXTERNAL;
       CREATE TABLE snapshot (
         session bigint PRIMARY KEY,
         sequence bigint NOT NULL,
         rows bigint NOT NULL,
         state bytea NOT NULL);
       ALTER TABLE snapshot ALTER state SET STORAGE EXTERNAL;
       CREATE TABLE history (
         session bigint NOT NULL,
         ordinal bigint NOT NULL,
         sequence bigint NOT NULL,
         point bytea NOT NULL,
         PRIMARY KEY (session, ordinal));
       CREATE TABLE deleted (session bigint PRIMARY KEY);
       CREATE TABLE node (
         node bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
         name text NOT NULL,
         address text NOT NULL,
         lease_until timestamptz NOT NULL);
       CREATE TABLE owner (
         session bigint PRIMARY KEY,
         node bigint,
         epoch bigint NOT NULL) WITH (fillfactor = 50);
       CREATE INDEX owner_by_node ON owner (node);)",
    R"(ALTER TABLE node
         ADD streams bigint NOT NULL DEFAULT 0,
         ADD busy_cores double precision NOT NULL DEFAULT 0,
         ADD draining boolean NOT NULL DEFAULT false;)",
    // The parts of large batches but their last ones, and how many a batch has (batch_parts.h).
    R"(CREATE TABLE part (
         session bigint NOT NULL,
         sequence bigint NOT NULL,
         number bigint NOT NULL,
         bytes bytea NOT NULL,
         PRIMARY KEY (session, sequence, number));
       ALTER TABLE part ALTER bytes SET STORAGE EXTERNAL;
       ALTER TABLE batch ADD parts bigint NOT NULL DEFAULT 0;)",
};

absl::Status Refused(const absl::Status& status, const char* doing) {
  if (absl::IsUnavailable(status)) return status;
  return absl::FailedPreconditionError(absl::StrFormat("%s: %s", doing, status.message()));
}

absl::StatusOr<int64_t> FirstNumber(PostgresConnection& connection, const char* sql) {
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult result, connection.Query(sql));
  return result.rows() == 0 ? 0 : result.Integer(0, 0);
}

absl::Status CheckServer(PostgresConnection& connection) {
  POLYEST_ASSIGN_OR_RETURN(
      const int64_t unsafe,
      FirstNumber(
          connection,
          "SELECT count(*) FROM pg_settings WHERE name IN ('fsync', 'full_page_writes') AND "
          "setting = 'off'"));
  if (unsafe == 0) return absl::OkStatus();
  return absl::FailedPreconditionError(
      "the database's server has fsync or full_page_writes off: what it acknowledges may be lost");
}

// Returns the version of the schema polyest; 0: there is no such schema.
absl::StatusOr<int64_t> PresentVersion(PostgresConnection& connection) {
  POLYEST_ASSIGN_OR_RETURN(
      const int64_t schemas,
      FirstNumber(connection, "SELECT count(*) FROM pg_namespace WHERE nspname = 'polyest'"));
  if (schemas == 0) return 0;
  POLYEST_ASSIGN_OR_RETURN(
      const int64_t own,
      FirstNumber(connection,
                  "SELECT count(*) FROM pg_class JOIN pg_namespace ON pg_namespace.oid = "
                  "relnamespace WHERE nspname = 'polyest' AND relname = 'schema_version'"));
  if (own == 0) {
    return absl::FailedPreconditionError(
        "the database has a schema polyest that belongs to another program");
  }
  const auto version =
      FirstNumber(connection, "SELECT coalesce(max(version), 0) FROM schema_version");
  if (!version.ok()) return Refused(version.status(), "reading the version of the schema polyest");
  if (*version > PostgresSchemaVersion()) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "the schema polyest has the format %d of a later version of polyest; this one knows "
        "formats up to %d",
        *version, PostgresSchemaVersion()));
  }
  return *version;
}

// Runs in a transaction that nobody else runs at the same time.
absl::Status Migrate(PostgresConnection& connection) {
  // The number is an arbitrary one that no other program is likely to lock.
  POLYEST_RETURN_IF_ERROR(connection.Execute("SELECT pg_advisory_xact_lock(8101824912)"));
  POLYEST_ASSIGN_OR_RETURN(const int64_t present, PresentVersion(connection));
  if (present == PostgresSchemaVersion()) return absl::OkStatus();
  if (present == 0) {
    POLYEST_RETURN_IF_ERROR(connection.Execute(
        "CREATE SCHEMA polyest; CREATE TABLE schema_version (version bigint NOT NULL)"));
  }
  for (int64_t i = present; i < PostgresSchemaVersion(); ++i) {
    POLYEST_RETURN_IF_ERROR(connection.Execute(kPostgresMigrations[i]));
  }
  return connection.Execute(
      absl::StrFormat("DELETE FROM schema_version; INSERT INTO schema_version VALUES (%d)",
                      PostgresSchemaVersion()));
}

}  // namespace

int64_t PostgresSchemaVersion() { return std::ssize(kPostgresMigrations); }

absl::Status PreparePostgresSchema(PostgresConnection& connection) {
  POLYEST_RETURN_IF_ERROR(CheckServer(connection));
  POLYEST_RETURN_IF_ERROR(connection.Execute("BEGIN"));
  absl::Status migrated = Migrate(connection);
  if (migrated.ok()) {
    migrated = connection.Execute("COMMIT");
  } else if (!connection.broken()) {
    connection.Execute("ROLLBACK").IgnoreError();
  }
  if (migrated.ok() || absl::IsFailedPrecondition(migrated)) return migrated;
  return Refused(migrated, "the schema polyest cannot be made or upgraded");
}

}  // namespace polyest::internal
