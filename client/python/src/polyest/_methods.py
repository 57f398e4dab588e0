"""The methods of the daemon that the package calls, with the types of their messages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from google.protobuf import empty_pb2

from polyest._proto.v1 import estimate_pb2 as estimate
from polyest._proto.v1 import model_service_pb2 as model
from polyest._proto.v1 import problem_service_pb2 as problem
from polyest._proto.v1 import session_service_pb2 as session
from polyest._proto.v1 import status_service_pb2 as status
from polyest._proto.v1 import study_service_pb2 as study

Request = TypeVar("Request")
Response = TypeVar("Response")


@dataclass(frozen=True)
class Method(Generic[Request, Response]):
    """A method of a service."""

    service: str
    name: str
    request: type[Request]
    response: type[Response]

    @property
    def path(self) -> str:
        """The path of the method in HTTP/2."""
        return f"/polyest.v1.{self.service}/{self.name}"


LIST_MODELS = Method("ModelService", "ListModels", model.ListModelsRequest,
                     model.ListModelsResponse)
GET_MODEL = Method("ModelService", "GetModel", model.GetModelRequest, model.Model)

CHECK_PROBLEM = Method("ProblemService", "CheckProblem", problem.CheckProblemRequest,
                       problem.CheckProblemResponse)
GET_PROBLEM_SCHEMA = Method("ProblemService", "GetProblemSchema", problem.GetProblemSchemaRequest,
                            problem.GetProblemSchemaResponse)

CREATE_SESSION = Method("SessionService", "CreateSession", session.CreateSessionRequest,
                        session.Session)
GET_SESSION = Method("SessionService", "GetSession", session.GetSessionRequest, session.Session)
LIST_SESSIONS = Method("SessionService", "ListSessions", session.ListSessionsRequest,
                       session.ListSessionsResponse)
DELETE_SESSION = Method("SessionService", "DeleteSession", session.DeleteSessionRequest,
                        empty_pb2.Empty)
EXPORT_SESSION = Method("SessionService", "ExportSession", session.ExportSessionRequest,
                        session.SessionRecord)
IMPORT_SESSION = Method("SessionService", "ImportSession", session.ImportSessionRequest,
                        session.Session)
ADD_MEASUREMENTS = Method("SessionService", "AddMeasurements", session.AddMeasurementsRequest,
                          session.AddMeasurementsResponse)
GET_ESTIMATE = Method("SessionService", "GetEstimate", session.GetEstimateRequest,
                      estimate.Estimate)
GET_HISTORY = Method("SessionService", "GetHistory", session.GetHistoryRequest,
                     session.GetHistoryResponse)
STREAM_MEASUREMENTS = Method("SessionService", "StreamMeasurements",
                             session.StreamMeasurementsRequest, session.StreamMeasurementsResponse)
WATCH_SESSION = Method("SessionService", "WatchSession", session.WatchSessionRequest,
                       session.WatchSessionResponse)

COMPUTE_ESTIMATE = Method("StudyService", "ComputeEstimate", study.ComputeEstimateRequest,
                          study.ComputeEstimateResponse)
COMPUTE_PROPAGATION = Method("StudyService", "ComputePropagation",
                             study.ComputePropagationRequest, study.ComputePropagationResponse)
COMPUTE_COST_GRID = Method("StudyService", "ComputeCostGrid", study.ComputeCostGridRequest,
                           study.ComputeCostGridResponse)
COMPUTE_SENSITIVITY = Method("StudyService", "ComputeSensitivity",
                             study.ComputeSensitivityRequest, study.ComputeSensitivityResponse)
COMPUTE_EXPERIMENT_DESIGN = Method("StudyService", "ComputeExperimentDesign",
                                   study.ComputeExperimentDesignRequest,
                                   study.ComputeExperimentDesignResponse)
COMPUTE_POSTERIOR = Method("StudyService", "ComputePosterior", study.ComputePosteriorRequest,
                           study.ComputePosteriorResponse)
COMPUTE_COST_PROFILES = Method("StudyService", "ComputeCostProfiles",
                               study.ComputeCostProfilesRequest,
                               study.ComputeCostProfilesResponse)
COMPUTE_REGULARIZATION_SWEEP = Method("StudyService", "ComputeRegularizationSweep",
                                      study.ComputeRegularizationSweepRequest,
                                      study.ComputeRegularizationSweepResponse)
PREDICT = Method("StudyService", "Predict", study.PredictRequest, study.PredictResponse)

GET_STATUS = Method("StatusService", "GetStatus", status.GetStatusRequest, status.DaemonStatus)
