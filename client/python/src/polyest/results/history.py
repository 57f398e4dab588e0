"""How the estimates of a record came about."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from polyest._messages import enum_name, enumerator_name
from polyest._proto.v1 import estimate_pb2

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class ParameterThen:
    """A parameter as it was estimated then; values are in `unit`."""

    #: The name.
    name: str
    #: The unit; "1" for a pure number, empty where the equations give none.
    unit: str
    #: The posterior's mean.
    mean: float
    #: The standard deviation.
    std_dev: float
    #: The posterior's 2.5 % quantile.
    lower95: float
    #: The posterior's 97.5 % quantile.
    upper95: float
    #: "IDENTIFIED", "WEAK" or "NOT_IDENTIFIED".
    verdict: str


@dataclass(frozen=True)
class HistoryPoint:
    """One estimate, in short."""

    #: Time of the last sample, s since its run began.
    time_s: float
    #: Values taken into account.
    sample_count: int
    #: The session's last batch taken into account; 0 where there are no batches.
    sequence: int
    #: The parameters by name.
    parameters: dict[str, ParameterThen]
    #: The values at that time of the parameters that drift, by name; their verdict is empty. Of
    #: these, `parameters` has the values at the beginning.
    drifting: dict[str, ParameterThen]
    #: The codes of the diagnostics that the estimate had, such as "MODEL_MISFIT".
    warnings: list[str]
    #: How often the outputs had been expanded again.
    reexpansion_count: int


@dataclass(frozen=True)
class History:
    """Earlier estimates, the first one first."""

    #: The estimates.
    points: list[HistoryPoint]

    def __len__(self) -> int:
        """Returns the number of estimates."""
        return len(self.points)

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns a DataFrame with a row for each estimate and parameter."""
        import pandas as pd

        return pd.DataFrame([
            {"t": point.time_s, "samples": point.sample_count, "sequence": point.sequence,
             **vars(parameter)}
            for point in self.points for parameter in point.parameters.values()])

    def plot(self) -> Figure:
        """Draws means and 95 % intervals over time. Returns a matplotlib figure."""
        from polyest import plot

        return plot.history(self)


def of_message(message: estimate_pb2.EstimateHistory) -> History:
    """Returns a history as the daemon has sent it."""
    return History([
        HistoryPoint(point.time_s, point.sample_count, point.sequence,
                     {one.name: _then(one, enum_name(one, "verdict")) for one in point.parameters},
                     {one.name: _then(one, "") for one in point.drifting},
                     [enumerator_name(point, "warnings", code) for code in point.warnings],
                     point.reexpansion_count)
        for point in message.points])


def _then(message: estimate_pb2.EstimateHistory.Parameter, verdict: str) -> ParameterThen:
    return ParameterThen(message.name, message.unit, message.mean, message.std_dev,
                         message.lower95, message.upper95, verdict)
