"""What a next experiment is expected to tell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from polyest import _html
from polyest._messages import array
from polyest._proto.v1 import study_service_pb2
from polyest._table import Floats
from polyest.estimate_parts import Diagnostic

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Gain:
    """What some samples are expected to tell."""

    #: Expected information gain, bits, ≥ 0: one bit halves one standard deviation.
    bits: float
    #: (n,), expected standard deviation of each parameter afterwards, in its unit.
    std_dev: Floats


@dataclass(frozen=True)
class DesignOutput:
    """What one output tells at all times."""

    #: The output's name.
    name: str
    #: Its unit; "1" for a pure number, empty where the equations give none.
    unit: str
    #: Root mean square of the noise assumed, in `unit`.
    noise_std_dev: float
    #: Whether the problem measures this output.
    measured: bool
    #: The gain of this output alone.
    alone: Gain
    #: The gain of this output together with all that the problem measures.
    together: Gain


@dataclass(frozen=True)
class DesignCandidate:
    """One way to drive the model, and what it would tell."""

    #: The request's name of it; empty for the problem's own inputs.
    name: str
    #: The gain of all outputs that the problem measures, at all times.
    gain: Gain
    #: The gain of each output, the measured ones first.
    outputs: dict[str, DesignOutput]
    #: The best times, each the best one to add to those before it, with the gain of all so far.
    samples: list[tuple[float, Gain]]
    #: Draws of the true value over which the gains are averaged.
    draws: int
    #: Trajectories integrated for the model's slopes at the draws.
    trajectories: int
    #: POINTS_FAILED where trajectories could not be integrated; their draws are left out.
    diagnostics: list[Diagnostic]


@dataclass(frozen=True)
class ExperimentDesign:
    """What a next experiment would tell, for each way to drive it."""

    #: (mean, standard deviation, unit) of each parameter as it is known beforehand.
    parameters: dict[str, tuple[float, float, str]]
    #: The candidates, the one with the largest gain first.
    candidates: list[DesignCandidate]
    #: Warnings of the estimate from the measurements.
    diagnostics: list[Diagnostic]
    #: The session's last batch taken into account; 0 without one.
    sequence: int

    @property
    def best(self) -> DesignCandidate:
        """The candidate with the largest gain."""
        return self.candidates[0]

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns a DataFrame with a row for each candidate, output and parameter."""
        import pandas as pd

        return pd.DataFrame([
            {"candidate": one.name, "output": output.name, "measured": output.measured,
             "bits": output.together.bits, "parameter": parameter,
             "std_dev": float(output.together.std_dev[i])}
            for one in self.candidates for output in one.outputs.values()
            for i, parameter in enumerate(self.parameters)])

    def _repr_html_(self) -> str:
        rows = [(one.name or "as it is", f"{one.gain.bits:.2f}",
                 *(_html.number(value, 2) for value in one.gain.std_dev))
                for one in self.candidates]
        return _html.page(_html.table(
            ("experiment", "bits", *(f"sd of {name}" for name in self.parameters)), rows))


def _gain(message: Any) -> Gain:
    return Gain(message.bits, array(message.std_dev))


def _candidate(message: Any) -> DesignCandidate:
    return DesignCandidate(
        message.name, _gain(message.gain),
        {one.name: DesignOutput(one.name, one.unit, one.noise_std_dev, one.measured,
                                _gain(one.alone), _gain(one.together))
         for one in message.outputs},
        [(one.time_s, _gain(one.gain)) for one in message.samples],
        message.draw_count, message.trajectory_count,
        [Diagnostic.of_message(one) for one in message.diagnostics])


def of_message(message: study_service_pb2.ComputeExperimentDesignResponse) -> ExperimentDesign:
    """Returns a design as the daemon has sent it."""
    return ExperimentDesign(
        {one.name: (one.mean, one.std_dev, one.unit) for one in message.parameters},
        [_candidate(one) for one in message.candidates],
        [Diagnostic.of_message(one) for one in message.diagnostics], message.sequence)
