"""The model's outputs at single draws of the posterior, by a call of the daemon for each draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polyest._proto.v1 import problem_pb2
from polyest._table import Floats, refuse
from polyest.results import Posterior

if TYPE_CHECKING:
    from polyest.client import Experiment

# The standard deviation of the parameter that must stay uncertain, as a part of its value.
_POINT = 1e-9


# The most rows of a record in an answer of the daemon.
MOST_ROWS = 1_000_000


@dataclass(frozen=True)
class OutputsAtDraws:
    """One output at each draw."""

    #: (draws, rows), in the output's unit.
    mean: Floats
    #: (draws, rows), the standard deviation of the noise there.
    noise: Floats


def outputs_at_draws(experiment: Experiment, posterior: Posterior) -> dict[str, OutputsAtDraws]:
    """Returns each measured output at the samples of the posterior, and the noise there.

    Raises InvalidInput for problems whose samples are not independent given the parameters.
    """
    _check(experiment._problem())
    names = list(posterior.parameters)
    means: dict[str, list[Floats]] = {}
    noises: dict[str, list[Floats]] = {}
    for draw in posterior.samples:
        fixed = _problem_at(experiment._problem(), dict(zip(names, map(float, draw))))
        prediction = experiment._with(fixed).predict(draws=2, max_rows=MOST_ROWS)
        for name, one in prediction.outputs.items():
            if one.sample_std_dev is None:
                raise refuse("predictive", f"the noise of {name} is not known")
            means.setdefault(name, []).append(one.mean)
            noises.setdefault(name, []).append(np.asarray(one.sample_std_dev))
    return {name: OutputsAtDraws(np.stack(means[name]), np.stack(noises[name])) for name in means}


def _check(problem: problem_pb2.Problem) -> None:
    what = ""
    if problem.process_noise or problem.likelihood == problem_pb2.Problem.PREDICTION_ERROR:
        what = "process noise or prediction errors"
    elif any(one.per_run or one.HasField("drift") for one in problem.uncertain):
        what = "parameters that drift, or that each run has of its own"
    elif any(one.noise.unknown or one.noise.HasField("correlation")
             or one.noise.outliers > 1 for one in problem.measured):
        what = "noise that is unknown, correlated or has outliers"
    if what:
        raise refuse("predictive", f"is not there for problems with {what}: only the daemon knows "
                     "the density of their samples")


def _problem_at(problem: problem_pb2.Problem, values: dict[str, float]) -> problem_pb2.Problem:
    """Returns a problem whose parameters are known; one has to stay uncertain, but hardly is."""
    found = problem_pb2.Problem()
    found.CopyFrom(problem)
    del found.uncertain[:]
    del found.correlations[:]
    (first, value), *others = values.items()
    for name, other in others:
        found.fixed[name] = other
    scale = abs(value) or 1.0
    kept = found.uncertain.add(name=first)
    kept.normal.mean, kept.normal.std_dev = value, _POINT * scale
    return found
