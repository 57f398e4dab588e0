#pragma once

// The functions of libpq, which is loaded when a database is first named. It brings twenty other
// libraries, which would make the start of every daemon a quarter longer, and few daemons have a
// database.

#include <absl/status/status.h>
#include <libpq-fe.h>

#define POLYEST_LIBPQ_FUNCTIONS(F) \
  F(PQclear)                       \
  F(PQcmdStatus)                   \
  F(PQcmdTuples)                   \
  F(PQconnectdbParams)             \
  F(PQconninfoFree)                \
  F(PQconninfoParse)               \
  F(PQconsumeInput)                \
  F(PQenterPipelineMode)           \
  F(PQerrorMessage)                \
  F(PQexitPipelineMode)            \
  F(PQfinish)                      \
  F(PQflush)                       \
  F(PQfreemem)                     \
  F(PQgetResult)                   \
  F(PQgetlength)                   \
  F(PQgetvalue)                    \
  F(PQisBusy)                      \
  F(PQntuples)                     \
  F(PQpipelineSync)                \
  F(PQresultErrorField)            \
  F(PQresultStatus)                \
  F(PQsendPrepare)                 \
  F(PQsendQuery)                   \
  F(PQsendQueryPrepared)           \
  F(PQsetNoticeReceiver)           \
  F(PQsetnonblocking)              \
  F(PQsocket)                      \
  F(PQstatus)

namespace polyest::internal {

struct LibpqFunctions {
#define POLYEST_LIBPQ_MEMBER(name) decltype(&::name) name = nullptr;
  POLYEST_LIBPQ_FUNCTIONS(POLYEST_LIBPQ_MEMBER)
#undef POLYEST_LIBPQ_MEMBER
};

// Loads libpq, once. FAILED_PRECONDITION when it cannot be loaded.
absl::Status LoadLibpq();

// Returns the functions. It must have been loaded, as it has where there is a PostgresTarget.
const LibpqFunctions& Libpq();

}  // namespace polyest::internal
