#include "server/service/study_jobs.h"

#include <concepts>
#include <optional>
#include <utility>

#include "core/common/status.h"
#include "proto/wire/convert/annotate.h"
#include "proto/wire/convert/problem.h"
#include "proto/wire/operations/operations.h"
#include "server/service/session_rows.h"

namespace polyest::internal {
namespace {

// Returns the largest number of threads on which a call computes: that of the executor, which has
// them while no other task needs them.
int ThreadsOf(const ServiceContext& context) { return context.executor.threads_per_lane(); }

// Lists the studies: each is a function of proto/wire/operations, of its request and of what it is
// computed from, and a method of StudyService.
#define POLYEST_FOR_EACH_STUDY(DO) \
  DO(ComputeEstimate)              \
  DO(ComputePropagation)           \
  DO(ComputeCostGrid)              \
  DO(ComputeSensitivity)           \
  DO(ComputeExperimentDesign)      \
  DO(ComputePosterior)             \
  DO(ComputeCostProfiles)          \
  DO(ComputeLogDensity)            \
  DO(ComputeRegularizationSweep)   \
  DO(Predict)

// The overloads of Run give all studies one name. The arguments after the request select a study of
// an experiment or of an estimator.
#define POLYEST_RUN(Study) \
  auto Run(const v1::Study##Request& request, auto&&... of) { return Study(request, of...); }
POLYEST_FOR_EACH_STUDY(POLYEST_RUN)
#undef POLYEST_RUN

// Selects the studies of the prior, which need nothing of a session but its problem.
template <typename Request>
concept IsOfThePrior = std::same_as<Request, v1::ComputePropagationRequest> ||
    std::same_as<Request, v1::ComputeSensitivityRequest>;

// The overloads of OnStrand answer a study of a session on its strand: from its estimator, or from
// its rows.

absl::Status OnStrand(const v1::ComputeEstimateRequest& request, Session& session,
                      const ServiceContext&, const Stop& stop,
                      v1::ComputeEstimateResponse& response) {
  POLYEST_ASSIGN_OR_RETURN(const SharedEstimate estimate, session.CurrentEstimate(stop));
  *response.mutable_estimate() = *estimate;
  if (request.history_point_count() > 0) {
    POLYEST_ASSIGN_OR_RETURN(*response.mutable_history(), session.History());
  }
  return absl::OkStatus();
}

absl::Status OnStrand(const v1::ComputeExperimentDesignRequest& request, Session& session,
                      const ServiceContext& context, const Stop& stop,
                      v1::ComputeExperimentDesignResponse& response) {
  POLYEST_ASSIGN_OR_RETURN(const v1::Problem problem, session.ReadProblem());
  const auto design = [&](Estimator& estimator, int64_t sequence) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(estimator.Process(stop));
    std::optional<Estimate> known;
    if (estimator.rows_processed() > 0) {
      POLYEST_ASSIGN_OR_RETURN(known, estimator.CurrentEstimate(stop));
    }
    POLYEST_ASSIGN_OR_RETURN(
        response,
        ComputeExperimentDesign(request, problem, known, ThreadsOf(context), stop, context.models));
    response.set_sequence(sequence);
    return absl::OkStatus();
  };
  return session.WithEstimator(design, stop);
}

absl::Status OnStrand(v1::ComputeCostGridRequest request, Session& session,
                      const ServiceContext& context, const Stop& stop,
                      v1::ComputeCostGridResponse& response) {
  v1::Experiment& experiment = *request.mutable_subject()->mutable_experiment();
  POLYEST_ASSIGN_OR_RETURN(*experiment.mutable_problem(), session.ReadProblem());
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem resolved,
                           ToProblem(experiment.problem(), context.models));
  POLYEST_ASSIGN_OR_RETURN(const RunCuts cuts, session.Cuts(stop));
  POLYEST_ASSIGN_OR_RETURN(const int64_t sequence, ReadRows(session, resolved, cuts, stop,
                                                            *experiment.mutable_measurements()));
  POLYEST_ASSIGN_OR_RETURN(response,
                           Run(request, ThreadsOf(context), stop, context.models, ProblemLimits()));
  response.set_sequence(sequence);
  return absl::OkStatus();
}

template <typename Request, typename Response>
absl::Status OnStrand(const Request& request, Session& session, const ServiceContext&,
                      const Stop& stop, Response& response) {
  const auto answer = [&](Estimator& estimator, int64_t sequence) -> absl::Status {
    POLYEST_ASSIGN_OR_RETURN(response, Run(request, estimator, stop));
    response.set_sequence(sequence);
    return absl::OkStatus();
  };
  return session.WithEstimator(answer, stop);
}

// Runs a study of the prior on the problem of a session. The limits of a problem do not apply,
// because a session that exists stays, whatever the limits are now.
template <IsOfThePrior Request, typename Response>
absl::Status OfStoredProblem(Request request, const Session& session, const ServiceContext& context,
                             const Stop& stop, Response& response) {
  POLYEST_ASSIGN_OR_RETURN(*request.mutable_subject()->mutable_experiment()->mutable_problem(),
                           session.ReadProblem());
  POLYEST_ASSIGN_OR_RETURN(response,
                           Run(request, ThreadsOf(context), stop, context.models, ProblemLimits()));
  return absl::OkStatus();
}

}  // namespace

template <typename Request, typename Response>
absl::StatusOr<Job> StudyJob(const ServiceContext& context, const Caller& caller,
                             const Request* request, Response* response) {
  const v1::Subject& subject = request->subject();
  if (!subject.has_session()) {
    return JobOfCaller(context, caller, [=, &context](const Caller&, const Stop& stop) {
      const SessionServices& services = context.sessions.services();
      const absl::Status room = services.memory.Check();
      if (!room.ok()) return room;
      return Deliver(
          Run(*request, ThreadsOf(context), stop, context.models, services.limits.problem),
          response);
    });
  }
  if constexpr (IsOfThePrior<Request>) {
    const auto run = [=, &context](const Caller& asking, const Stop& stop) -> absl::Status {
      POLYEST_ASSIGN_OR_RETURN(const auto session,
                               FindSession(context, asking, "subject.session", subject.session()));
      POLYEST_RETURN_IF_ERROR(context.sessions.services().memory.Check());
      return OfStoredProblem(*request, *session, context, stop, *response);
    };
    return JobOfCaller(context, caller, run);
  } else {
    return JobOfSession(context, caller, "subject.session", subject.session(),
                        [=, &context](const std::shared_ptr<Session>& found, const Stop& stop) {
                          return OnStrand(*request, *found, context, stop, *response);
                        });
  }
}

#define POLYEST_STUDY_JOB(Study)                                              \
  template absl::StatusOr<Job> StudyJob(const ServiceContext&, const Caller&, \
                                        const v1::Study##Request*, v1::Study##Response*);
POLYEST_FOR_EACH_STUDY(POLYEST_STUDY_JOB)
#undef POLYEST_STUDY_JOB
#undef POLYEST_FOR_EACH_STUDY

absl::StatusOr<Job> ComputationJob(const ServiceContext& context, const Caller& caller,
                                   const v1::StartComputationRequest* request,
                                   v1::ComputationResult* result) {
  const auto job = [&](const auto& study, auto* answer) {
    return StudyJob(context, caller, &study, answer);
  };
  switch (request->computation_case()) {
    case v1::StartComputationRequest::kEstimate:
      return job(request->estimate(), result->mutable_estimate());
    case v1::StartComputationRequest::kPropagation:
      return job(request->propagation(), result->mutable_propagation());
    case v1::StartComputationRequest::kCostGrid:
      return job(request->cost_grid(), result->mutable_cost_grid());
    case v1::StartComputationRequest::kSensitivity:
      return job(request->sensitivity(), result->mutable_sensitivity());
    case v1::StartComputationRequest::kExperimentDesign:
      return job(request->experiment_design(), result->mutable_experiment_design());
    case v1::StartComputationRequest::kPosterior:
      return job(request->posterior(), result->mutable_posterior());
    case v1::StartComputationRequest::kCostProfiles:
      return job(request->cost_profiles(), result->mutable_cost_profiles());
    case v1::StartComputationRequest::kRegularizationSweep:
      return job(request->regularization_sweep(), result->mutable_regularization_sweep());
    case v1::StartComputationRequest::kPrediction:
      return job(request->prediction(), result->mutable_prediction());
    case v1::StartComputationRequest::COMPUTATION_NOT_SET:
      break;
  }
  return InvalidField("computation", "one must be given, such as estimate or posterior");
}

namespace {

// Returns the field with the request of the study; null if there is none.
const google::protobuf::FieldDescriptor* StudyIn(const v1::StartComputationRequest& request) {
  return v1::StartComputationRequest::GetReflection()->GetOneofFieldDescriptor(
      request, v1::StartComputationRequest::descriptor()->FindOneofByName("computation"));
}

}  // namespace

std::string MethodOf(const v1::StartComputationRequest& request) {
  const auto* const study = StudyIn(request);
  if (study == nullptr) return "";
  const std::string& message = study->message_type()->name();
  return message.substr(0, message.size() - std::string("Request").size());
}

std::string SessionOf(const v1::StartComputationRequest& request) {
  const auto* const field = StudyIn(request);
  if (field == nullptr) return "";
  const auto& study = v1::StartComputationRequest::GetReflection()->GetMessage(request, field);
  const auto* const subject = study.GetDescriptor()->FindFieldByName("subject");
  return static_cast<const v1::Subject&>(study.GetReflection()->GetMessage(study, subject))
      .session();
}

}  // namespace polyest::internal
