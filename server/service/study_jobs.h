#pragma once

// Makes the jobs that compute what StudyService answers, for a unary call or for an operation.

#include <absl/status/statusor.h>

#include "polyest/v1/operation_service.pb.h"
#include "polyest/v1/study_service.pb.h"
#include "server/service/calls.h"

namespace polyest::internal {

// Returns the job that writes the answer of a study into `response`, for each pair of a request and
// a response of StudyService. Both must live until the job has finished. NOT_FOUND for a session
// that the caller does not have, INVALID_ARGUMENT for a bad name of one. Without a subject it is
// the job that fails with INVALID_ARGUMENT.
template <typename Request, typename Response>
absl::StatusOr<Job> StudyJob(const ServiceContext& context, const Caller& caller,
                             const Request* request, Response* response);

// Returns the job of the computation that the request names; INVALID_ARGUMENT if it names none.
absl::StatusOr<Job> ComputationJob(const ServiceContext& context, const Caller& caller,
                                   const v1::StartComputationRequest* request,
                                   v1::ComputationResult* result);

// Returns the name of the method of StudyService that computes what the request names; empty if it
// names no computation.
std::string MethodOf(const v1::StartComputationRequest& request);

// Returns the name of the session of which it is computed; empty if it is none.
std::string SessionOf(const v1::StartComputationRequest& request);

}  // namespace polyest::internal
