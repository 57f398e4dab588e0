#include "server/journal/postgres_connection.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <poll.h>
#include <spdlog/spdlog.h>

#include <bit>
#include <cstdlib>
#include <utility>

#include "core/common/status.h"
#include "server/journal/libpq.h"
#include "server/journal/postgres_status.h"

namespace polyest::internal {
namespace {

using Deadline = std::chrono::steady_clock::time_point;

// PostgreSQL's numbers of types (pg_type.dat), which never change.
constexpr Oid kBool = 16, kBytea = 17, kInt8 = 20, kText = 25, kFloat8 = 701;
constexpr Oid kInt8Array = 1016;

// Longest time for connecting to one host, s.
constexpr char kConnectTimeoutS[] = "5";
// Longest time for which what is sent may stay without a sign of the peer, ms.
constexpr char kTcpTimeoutMs[] = "10000";

std::string_view Field(const PGresult* result, int field) {
  const char* text = Libpq().PQresultErrorField(result, field);
  return text == nullptr ? "" : text;
}

absl::Status StatusOf(const PGresult* result) {
  switch (Libpq().PQresultStatus(result)) {
    case PGRES_COMMAND_OK:
    case PGRES_TUPLES_OK:
      return absl::OkStatus();
    default:
      return FromSqlState(Field(result, PG_DIAG_SQLSTATE), Field(result, PG_DIAG_MESSAGE_PRIMARY));
  }
}

uint64_t BigEndian(const char* bytes) {
  uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) bits = bits << 8 | static_cast<unsigned char>(bytes[i]);
  return bits;
}

// Appends a number as PostgreSQL's binary format has it, its highest byte first.
void AppendBigEndian(uint64_t bits, int size, std::string& bytes) {
  for (int i = size - 1; i >= 0; --i) bytes += static_cast<char>(bits >> 8 * i);
}

std::string BytesOf(int64_t value) {
  std::string bytes;
  AppendBigEndian(static_cast<uint64_t>(value), 8, bytes);
  return bytes;
}
std::string BytesOf(double value) { return BytesOf(std::bit_cast<int64_t>(value)); }

// Returns an array in PostgreSQL's binary format: the number of dimensions, whether any element is
// NULL, the type, the number of elements, the index of the first, and each with its size.
std::string ArrayOf(const std::vector<int64_t>& elements) {
  std::string bytes;
  for (const uint64_t word : {size_t{1}, size_t{0}, size_t{kInt8}, elements.size(), size_t{1}}) {
    AppendBigEndian(word, 4, bytes);
  }
  for (const int64_t element : elements) {
    AppendBigEndian(8, 4, bytes);
    AppendBigEndian(static_cast<uint64_t>(element), 8, bytes);
  }
  return bytes;
}

}  // namespace

PostgresParameters& PostgresParameters::AddInside(unsigned type, std::string bytes) {
  Value& value = values_.emplace_back();
  value.type = type;
  value.size = static_cast<int>(bytes.size());
  value.inside = std::move(bytes);
  return *this;
}

PostgresParameters& PostgresParameters::Add(int64_t value) {
  return AddInside(kInt8, BytesOf(value));
}

PostgresParameters& PostgresParameters::Add(double value) {
  return AddInside(kFloat8, BytesOf(value));
}

PostgresParameters& PostgresParameters::AddFlag(bool flag) {
  return AddInside(kBool, std::string(1, flag ? '\1' : '\0'));
}

PostgresParameters& PostgresParameters::Add(const std::vector<int64_t>& values) {
  return AddInside(kInt8Array, ArrayOf(values));
}

PostgresParameters& PostgresParameters::AddText(std::string_view text) {
  AddBytes(text);
  values_.back().type = kText;
  return *this;
}

PostgresParameters& PostgresParameters::AddBytes(std::string_view bytes) {
  Value& value = values_.emplace_back();
  value.type = kBytea;
  value.size = static_cast<int>(bytes.size());
  // A null pointer would be NULL.
  value.outside = bytes.empty() ? "" : bytes.data();
  return *this;
}

PostgresResult::PostgresResult(pg_result* result) : result_(result, Libpq().PQclear) {}

int PostgresResult::rows() const { return Libpq().PQntuples(result_.get()); }

int64_t PostgresResult::changes() const { return std::atoll(Libpq().PQcmdTuples(result_.get())); }

std::string_view PostgresResult::command() const { return Libpq().PQcmdStatus(result_.get()); }

int64_t PostgresResult::Integer(int row, int column) const {
  if (Libpq().PQgetlength(result_.get(), row, column) != 8) return 0;
  return static_cast<int64_t>(BigEndian(Libpq().PQgetvalue(result_.get(), row, column)));
}

double PostgresResult::Real(int row, int column) const {
  return std::bit_cast<double>(Integer(row, column));
}

bool PostgresResult::Flag(int row, int column) const {
  return Libpq().PQgetlength(result_.get(), row, column) == 1 &&
         *Libpq().PQgetvalue(result_.get(), row, column) != 0;
}

std::string PostgresResult::Bytes(int row, int column) const {
  return {Libpq().PQgetvalue(result_.get(), row, column),
          static_cast<size_t>(Libpq().PQgetlength(result_.get(), row, column))};
}

absl::StatusOr<std::unique_ptr<PostgresConnection>> PostgresConnection::Open(
    const PostgresTarget& target) {
  // What comes after the URI holds against it; what comes before it are defaults.
  const char* const keys[] = {"fallback_application_name",
                              "connect_timeout",
                              "tcp_user_timeout",
                              "keepalives_idle",
                              "dbname",
                              "target_session_attrs",
                              "client_encoding",
                              nullptr};
  const char* const values[] = {"polyestd",           kConnectTimeoutS, kTcpTimeoutMs, "10",
                                target.uri().c_str(), "read-write",     "UTF8",        nullptr};
  std::unique_ptr<PostgresConnection> connection(
      new PostgresConnection(Libpq().PQconnectdbParams(keys, values, /*expand_dbname=*/1)));
  POLYEST_RETURN_IF_ERROR(connection->SetUp());
  return connection;
}

PostgresConnection::PostgresConnection(pg_conn* connection) : connection_(connection) {}

PostgresConnection::~PostgresConnection() { Libpq().PQfinish(connection_); }

absl::Status PostgresConnection::SetUp() {
  if (Libpq().PQstatus(connection_) != CONNECTION_OK) return Broken("no connection");
  if (Libpq().PQsetnonblocking(connection_, 1) != 0) return Broken("no connection");
  Libpq().PQsetNoticeReceiver(
      connection_,
      [](void* self, const PGresult* notice) {
        if (Field(notice, PG_DIAG_SEVERITY_NONLOCALIZED) != "WARNING") return;
        static_cast<PostgresConnection*>(self)->warned_ = true;
        spdlog::warn("the database warns: {}", Field(notice, PG_DIAG_MESSAGE_PRIMARY));
      },
      this);
  // A commit that does not wait for the disk, or for the standbys that the server is to wait for,
  // would be acknowledged and could be lost.
  return Execute(absl::StrCat(
      "SET search_path = polyest; SET client_min_messages = warning; SET statement_timeout = ",
      std::chrono::milliseconds(kStatementTimeout).count(),
      "; SET idle_in_transaction_session_timeout = 5000; SET lock_timeout = 3000; "
      "SET default_transaction_isolation = 'read committed'; "
      "SELECT set_config('synchronous_commit', 'on', false) "
      "WHERE current_setting('synchronous_commit') IN ('off', 'local')"));
}

absl::Status PostgresConnection::Broken(std::string_view what) {
  broken_ = true;
  const std::string said = absl::StrReplaceAll(
      absl::StripTrailingAsciiWhitespace(Libpq().PQerrorMessage(connection_)), {{"\n", " "}});
  spdlog::warn("the database that keeps the sessions: {}{}{}", what, said.empty() ? "" : ": ",
               said);
  return DatabaseAway(what);
}

absl::StatusOr<pg_result*> PostgresConnection::Next(Deadline deadline) {
  while (true) {
    const int unsent = Libpq().PQflush(connection_);
    if (unsent < 0) return Broken("the connection was lost");
    if (unsent == 0 && Libpq().PQisBusy(connection_) == 0) return Libpq().PQgetResult(connection_);
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return Broken("it does not answer");
    pollfd wait{.fd = Libpq().PQsocket(connection_),
                .events = static_cast<short>(unsent == 0 ? POLLIN : POLLIN | POLLOUT),
                .revents = 0};
    if (poll(&wait, 1, static_cast<int>(left.count()) + 1) < 0 && errno != EINTR) {
      return Broken("the connection was lost");
    }
    if ((wait.revents & ~POLLOUT) != 0 && Libpq().PQconsumeInput(connection_) == 0) {
      return Broken("the connection was lost");
    }
  }
}

// Takes results until the null that ends those of a statement, or those of all statements of a
// text.
absl::StatusOr<PostgresResult> PostgresConnection::Only() {
  const Deadline deadline = std::chrono::steady_clock::now() + kAnswerTimeout;
  PostgresResult last(nullptr);
  absl::Status failure;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(pg_result* const result, Next(deadline));
    if (result == nullptr) break;
    last = PostgresResult(result);
    if (failure.ok()) failure = StatusOf(result);
  }
  if (Libpq().PQstatus(connection_) != CONNECTION_OK) return Broken("the connection was lost");
  POLYEST_RETURN_IF_ERROR(failure);
  return last;
}

absl::Status PostgresConnection::Execute(const std::string& sql) {
  if (Libpq().PQsendQuery(connection_, sql.c_str()) == 0) return Broken("the connection was lost");
  return Only().status();
}

absl::StatusOr<std::string> PostgresConnection::Prepare(const char* sql,
                                                        const PostgresParameters& parameters) {
  const auto found = prepared_.find(sql);
  if (found != prepared_.end()) return found->second;
  std::vector<Oid> types;
  for (const auto& value : parameters.values_) types.push_back(value.type);
  std::string name = absl::StrCat("s", prepared_.size());
  if (Libpq().PQsendPrepare(connection_, name.c_str(), sql, static_cast<int>(types.size()),
                            types.data()) == 0) {
    return Broken("the connection was lost");
  }
  POLYEST_RETURN_IF_ERROR(Only().status());
  return prepared_.emplace(sql, std::move(name)).first->second;
}

absl::Status PostgresConnection::SendPrepared(const std::string& name,
                                              const PostgresParameters& parameters) {
  std::vector<const char*> values;
  std::vector<int> sizes, formats(parameters.values_.size(), 1);
  for (const auto& value : parameters.values_) {
    values.push_back(value.data());
    sizes.push_back(value.size);
  }
  if (Libpq().PQsendQueryPrepared(connection_, name.c_str(), static_cast<int>(values.size()),
                                  values.data(), sizes.data(), formats.data(),
                                  /*resultFormat=*/1) == 0) {
    return Broken("the connection was lost");
  }
  return absl::OkStatus();
}

absl::StatusOr<PostgresResult> PostgresConnection::Query(const char* sql,
                                                         const PostgresParameters& parameters) {
  POLYEST_ASSIGN_OR_RETURN(const std::string name, Prepare(sql, parameters));
  POLYEST_RETURN_IF_ERROR(SendPrepared(name, parameters));
  return Only();
}

absl::StatusOr<std::vector<PostgresResult>> PostgresConnection::Pipeline(
    const std::vector<PostgresStatement>& statements, Refused& refused) {
  std::vector<std::string> names;
  for (const PostgresStatement& statement : statements) {
    POLYEST_ASSIGN_OR_RETURN(names.emplace_back(), Prepare(statement.sql, statement.parameters));
  }
  if (Libpq().PQenterPipelineMode(connection_) == 0) return Broken("no pipeline");
  for (size_t i = 0; i < statements.size(); ++i) {
    POLYEST_RETURN_IF_ERROR(SendPrepared(names[i], statements[i].parameters));
  }
  if (Libpq().PQpipelineSync(connection_) == 0) return Broken("the connection was lost");
  std::vector<PostgresResult> results;
  const absl::Status read = ReadPipeline(statements.size(), results, refused);
  if (broken_) return read;
  if (Libpq().PQexitPipelineMode(connection_) == 0) return Broken("the pipeline does not end");
  POLYEST_RETURN_IF_ERROR(read);
  return results;
}

// Takes the results up to the synchronization at the end: each is followed by a null.
absl::Status PostgresConnection::ReadPipeline(size_t count, std::vector<PostgresResult>& results,
                                              Refused& refused) {
  const Deadline deadline = std::chrono::steady_clock::now() + kAnswerTimeout;
  absl::Status failure;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(pg_result* const given, Next(deadline));
    if (given == nullptr) {
      if (Libpq().PQstatus(connection_) != CONNECTION_OK) return Broken("the connection was lost");
      continue;
    }
    PostgresResult result(given);
    const ExecStatusType status = Libpq().PQresultStatus(given);
    if (status == PGRES_PIPELINE_SYNC) break;
    if (status == PGRES_PIPELINE_ABORTED) continue;
    if (failure.ok()) {
      failure = StatusOf(given);
      refused = {results.size(), Field(given, PG_DIAG_SQLSTATE) == "23505"};
      if (failure.ok()) results.push_back(std::move(result));
    }
    if (Libpq().PQstatus(connection_) != CONNECTION_OK) return Broken("the connection was lost");
  }
  if (failure.ok() && results.size() != count) return Broken("answers are missing");
  return failure;
}

}  // namespace polyest::internal
