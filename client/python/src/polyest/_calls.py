"""Calls of the daemon as data: method, request, and how the answer is read.

Synchronous and asynchronous clients run the same calls.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Optional, TypeVar, Union

import numpy as np
import numpy.typing as npt

from polyest import _methods, _parsing, _session_file, check, estimates, results
from polyest._measurements import MeasurementConverter
from polyest._proto.v1 import (
    measurements_pb2,
    problem_pb2,
    problem_service_pb2,
    session_service_pb2,
    study_service_pb2,
)
from polyest._request import json_of, make, mapping, number, numbers, whole, wrong
from polyest._table import Data, refuse
from polyest.errors import InvalidInput, WrongType
from polyest.problem import ProblemLike, to_message
from polyest.results import cost, design, history, posterior, prediction, prior
from polyest.signals import Signal

if TYPE_CHECKING:
    from polyest.studies import Studies

Result = TypeVar("Result")
Subject = study_service_pb2.Subject

#: Ways to drive the model in a next experiment: a name for each, and its inputs by name.
Candidates = Mapping[str, Mapping[str, Signal]]


@dataclass(frozen=True)
class Call(Generic[Result]):
    """A call that is not made yet."""

    method: _methods.Method[Any, Any]
    request: Any
    read: Callable[[Any], Result]


def subject_of_experiment(problem: problem_pb2.Problem,
                          measurements: Optional[measurements_pb2.Measurements]) -> Subject:
    """Returns a problem with its measurements as the subject of a study."""
    return Subject(experiment=study_service_pb2.Experiment(problem=problem,
                                                           measurements=measurements))


def subject_of_session(name: str) -> Subject:
    """Returns a session, `sessions/{id}`, as the subject of a study."""
    return Subject(session=name)


def compute_estimate(subject: Subject, source: Optional[Studies]) -> Call[estimates.Estimate]:
    """The estimate of a subject; `source` is what its plots ask for more."""
    return Call(_methods.COMPUTE_ESTIMATE,
                study_service_pb2.ComputeEstimateRequest(subject=subject),
                lambda answer: estimates.of_message(answer.estimate, source))


def compute_history(subject: Subject, points: int) -> Call[results.History]:
    """How the estimate of an experiment comes about."""
    return Call(_methods.COMPUTE_ESTIMATE,
                make(study_service_pb2.ComputeEstimateRequest, subject=subject,
                     history_point_count=whole("points", points, 1)),
                lambda answer: history.of_message(answer.history))


def create_session(name: str, problem: problem_pb2.Problem, window_s: Optional[float]
                   ) -> session_service_pb2.CreateSessionRequest:
    """The request for a new session."""
    return make(session_service_pb2.CreateSessionRequest, session_id=name,
                session=make(session_service_pb2.Session, problem=problem,
                             reorder_window_s=window_s))


def import_session(name: str, file: Union[str, os.PathLike[str]]
                   ) -> Iterator[session_service_pb2.ImportSessionRequest]:
    """The requests for a session from a file. Raises InvalidInput while they are made."""
    for record in _session_file.read(file):
        yield make(session_service_pb2.ImportSessionRequest, session_id=name, record=record)


def get_estimate(session: str, source: Optional[Studies]) -> Call[estimates.Estimate]:
    """The present estimate of a session."""
    return Call(_methods.GET_ESTIMATE, session_service_pb2.GetEstimateRequest(session=session),
                lambda answer: estimates.of_message(answer, source))


def get_history(session: str) -> Call[results.History]:
    """The history that the daemon keeps of a session."""
    return Call(_methods.GET_HISTORY, session_service_pb2.GetHistoryRequest(session=session),
                lambda answer: history.of_message(answer.history))


def check_problem(problem: ProblemLike, data: Optional[Data],
                  units: Optional[Mapping[str, str]]) -> Union[Call[check.Check], check.Check]:
    """What is wrong with a problem and its data.

    What no daemon can be asked about is found here: a value that a problem cannot have, which is
    then the only finding, and data that are no measurements.
    """
    try:
        message = to_message(problem)
    except InvalidInput as error:
        if isinstance(error, WrongType) or not error.field:
            raise
        return check.of_errors([error])
    converter = MeasurementConverter(message, units)
    faults: list[InvalidInput] = []
    measurements = None
    try:
        measurements = None if data is None else converter.convert(data)
    except InvalidInput as error:
        faults.append(error)
    return Call(_methods.CHECK_PROBLEM,
                problem_service_pb2.CheckProblemRequest(problem=message,
                                                        measurements=measurements),
                lambda answer: check.of_message(answer, faults))


def predict(subject: Subject, *, outputs: Sequence[str], probabilities: Sequence[float],
            draws: int, max_rows: int, times: Optional[npt.ArrayLike], run: int, lags: int,
            horizon_s: float, smoothed: bool, forecast_s: float, first_scored_row: int,
            record: Optional[measurements_pb2.Measurements]) -> Call[results.Prediction]:
    """The outputs over time as the posterior predicts them."""
    request = make(
        study_service_pb2.PredictRequest, subject=subject, outputs=outputs,
        probabilities=probabilities, draw_count=draws, max_row_count=max_rows,
        lag_count=lags, horizon_s=horizon_s, smoothed=smoothed, forecast_s=forecast_s,
        first_scored_row=first_scored_row, record=record)
    run = whole("run", run, 0)
    if times is not None:
        values = np.atleast_1d(numbers("times", times))
        if values.ndim > 1:
            raise refuse("times", f"has the shape {values.shape}; times have one dimension")
        request.times.extend(study_service_pb2.RecordTime(run=run, time_s=time_s)
                             for time_s in values)
    return Call(_methods.PREDICT, request, prediction.of_message)


def watch_predictions(session: str, outputs: Sequence[str], draws: int, max_rows: int,
                      min_interval_s: float) -> session_service_pb2.WatchSessionRequest:
    """The request for estimates of a session with predictions of its record."""
    policy = make(session_service_pb2.WatchSessionRequest.PredictionPolicy, outputs=outputs,
                  draw_count=draws, max_row_count=max_rows, min_interval_s=min_interval_s)
    return session_service_pb2.WatchSessionRequest(session=session, prediction=policy)


def compute_posterior(subject: Subject, *, probabilities: Sequence[float], density_bins: int,
                      joints: Sequence[tuple[str, str]], all_joints: bool, joint_bins: int,
                      samples: int) -> Call[results.Posterior]:
    """The posterior in detail."""
    request = make(
        study_service_pb2.ComputePosteriorRequest, subject=subject,
        probabilities=probabilities, density_bin_count=density_bins, joint_bin_count=joint_bins,
        sample_count=samples, all_joints=all_joints)
    if isinstance(joints, str) or not isinstance(joints, Iterable):
        raise wrong("joints", joints, 'pairs of names, as in [("k", "c")]')
    pair: Any
    for pair in joints:
        if isinstance(pair, str) or not isinstance(pair, Sequence) or len(pair) != 2:
            raise wrong("joints", pair, 'a pair of names, as in ("k", "c")')
        request.joints.append(make(study_service_pb2.ComputePosteriorRequest.ParameterPair,
                                   first=pair[0], second=pair[1]))
    return Call(_methods.COMPUTE_POSTERIOR, request, posterior.of_message)


def compute_profiles(subject: Subject, *, parameters: Sequence[str],
                     points: int) -> Call[results.CostProfiles]:
    """The cost over each parameter."""
    return Call(_methods.COMPUTE_COST_PROFILES,
                make(study_service_pb2.ComputeCostProfilesRequest,
                     subject=subject, parameters=parameters, point_count=points),
                cost.profiles_of)


def compute_cost_grid(subject: Subject, *, parameters: Sequence[str], points: int,
                      held: Mapping[str, float]) -> Call[results.CostGrid]:
    """The cost on a grid."""
    return Call(_methods.COMPUTE_COST_GRID,
                make(study_service_pb2.ComputeCostGridRequest,
                     subject=subject, parameters=parameters, point_count=points, held=held),
                cost.grid_of)


def compute_sweep(subject: Subject, *, lowest: float, highest: float,
                  points: int) -> Call[results.RegularizationSweep]:
    """The estimates over the weight of the prior."""
    return Call(_methods.COMPUTE_REGULARIZATION_SWEEP,
                make(study_service_pb2.ComputeRegularizationSweepRequest,
                     subject=subject, lowest=lowest, highest=highest, point_count=points),
                cost.sweep_of)


def compute_propagation(subject: Subject, *, until_s: float, step_s: float,
                        outputs: Sequence[str], probabilities: Sequence[float],
                        density_bins: int, draws: int) -> Call[results.Propagation]:
    """What the prior predicts."""
    return Call(_methods.COMPUTE_PROPAGATION,
                make(study_service_pb2.ComputePropagationRequest,
                     subject=subject, until_s=until_s, step_s=step_s, outputs=outputs,
                     probabilities=probabilities, density_bin_count=density_bins,
                     draw_count=draws),
                prior.propagation_of)


def compute_sensitivity(subject: Subject, *, until_s: float, step_s: float,
                        outputs: Sequence[str], draws: int) -> Call[results.Sensitivity]:
    """Which parameters the outputs depend on."""
    return Call(_methods.COMPUTE_SENSITIVITY,
                make(study_service_pb2.ComputeSensitivityRequest,
                     subject=subject, until_s=until_s, step_s=step_s, outputs=outputs,
                     draw_count=draws),
                prior.sensitivity_of)


def compute_design(subject: Subject, *, until_s: float, step_s: float, samples: int,
                   candidates: Candidates,
                   outputs: Mapping[str, float]) -> Call[results.ExperimentDesign]:
    """What a next experiment would tell."""
    request = make(
        study_service_pb2.ComputeExperimentDesignRequest, subject=subject, until_s=until_s,
        step_s=step_s, sample_count=samples)
    for name, inputs in mapping("candidates", candidates, "inputs by name").items():
        candidate = request.candidates.add(name=name)
        signals = mapping(f"candidates.{name}", inputs, "signals by input")
        for signal_name, signal in signals.items():
            candidate.inputs.append(
                input_of(f"candidates.{name}.{signal_name}", signal_name, signal))
    for output, noise in mapping("outputs", outputs, "noise by output").items():
        request.possible.add(output=output).noise.absolute = number(f"outputs.{output}", noise)
    return Call(_methods.COMPUTE_EXPERIMENT_DESIGN, request, design.of_message)


def input_of(path: str, name: str, signal: Signal) -> problem_pb2.Input:
    """Returns an input with its signal as a message; errors name it by `path`."""
    message = problem_pb2.Input()
    document = json_of(path, signal, "a signal, such as polyest.Step(1.0)")
    _parsing.parse({"name": name, **document}, message, prefix=path)
    return message
