"""The cost on a grid, over each parameter, and for several weights of the prior."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polyest._messages import array
from polyest._proto.v1 import study_service_pb2
from polyest._table import Floats
from polyest.estimate_parts import Cost, Diagnostic

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Axis:
    """An axis of a grid."""

    #: The parameter's name.
    parameter: str
    #: Its unit; "1" for a pure number, empty where the equations give none.
    unit: str
    #: (N,), its values, ascending, in `unit`.
    value: Floats


@dataclass(frozen=True)
class CostGrid:
    """The cost on a grid over one or two parameters, of shape (N,) or (N, N); pure numbers."""

    #: One axis for each parameter.
    axes: list[Axis]
    #: How far the model is from the samples; infinite where the model fails.
    mismatch: Floats
    #: How far the parameters are from what the prior prefers; infinite where its density is 0.
    prior: Floats
    #: mismatch + α² prior.
    total: Floats
    #: The session's last batch taken into account; 0 without one.
    sequence: int

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns a DataFrame with a row for each point of the grid."""
        import pandas as pd

        places = np.meshgrid(*(axis.value for axis in self.axes), indexing="ij")
        columns = {axis.parameter: place.ravel() for axis, place in zip(self.axes, places)}
        return pd.DataFrame({**columns, "mismatch": self.mismatch.ravel(),
                             "prior": self.prior.ravel(), "total": self.total.ravel()})

    def plot(self) -> Figure:
        """Draws the total cost: a curve or contours. Returns a matplotlib figure."""
        from polyest import plot

        return plot.cost(self)


def grid_of(message: study_service_pb2.ComputeCostGridResponse) -> CostGrid:
    """Returns a grid as the daemon has sent it."""
    axes = [Axis(one.parameter, one.unit, array(one.value)) for one in message.axes]
    shape = tuple(len(axis.value) for axis in axes)
    return CostGrid(axes, array(message.mismatch, *shape), array(message.prior, *shape),
                    array(message.total, *shape), message.sequence)


@dataclass(frozen=True)
class CostProfile:
    """The least cost with one parameter held at each of N values."""

    #: The parameter's name.
    parameter: str
    #: Its unit; "1" for a pure number, empty where the equations give none.
    unit: str
    #: (N,), its values, ascending, in `unit`.
    value: Floats
    #: (N,), the least cost, mismatch + α² prior; pure numbers.
    total: Floats
    #: (N,), the mismatch there.
    mismatch: Floats
    #: (N,), the prior's term there.
    prior: Floats
    #: (N, n), all parameters there, in their units.
    minima: Floats
    #: (N,), whether the minimizer converged.
    converged: npt.NDArray[np.bool_]


@dataclass(frozen=True)
class CostProfiles:
    """The cost over each parameter, minimized over the others."""

    #: The profiles by parameter.
    profiles: dict[str, CostProfile]
    #: All uncertain parameters: the columns of `CostProfile.minima`.
    parameters: list[str]
    #: The cost at the minimum over all parameters.
    least: Cost
    #: Warnings, as of an estimate.
    diagnostics: list[Diagnostic]
    #: The session's last batch taken into account; 0 without one.
    sequence: int

    def __getitem__(self, parameter: str) -> CostProfile:
        """Returns the profile of a parameter. Raises KeyError."""
        return self.profiles[parameter]

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns a DataFrame with a row for each parameter and value."""
        import pandas as pd

        return pd.concat([
            pd.DataFrame({"parameter": one.parameter, "value": one.value, "total": one.total,
                          "mismatch": one.mismatch, "prior": one.prior,
                          "converged": one.converged})
            for one in self.profiles.values()], ignore_index=True)

    def plot(self) -> Figure:
        """Draws each profile above the least cost. Returns a matplotlib figure."""
        from polyest import plot

        return plot.profiles(self)


def profiles_of(message: study_service_pb2.ComputeCostProfilesResponse) -> CostProfiles:
    """Returns profiles as the daemon has sent them."""
    count = len(message.parameters)
    return CostProfiles(
        {one.parameter: CostProfile(one.parameter, one.unit, array(one.value), array(one.total),
                                    array(one.mismatch), array(one.prior),
                                    array(one.minima, len(one.value), count),
                                    np.array(one.converged, dtype=bool))
         for one in message.profiles},
        list(message.parameters),
        Cost(message.least.total, message.least.mismatch, message.least.prior),
        [Diagnostic.of_message(one) for one in message.diagnostics], message.sequence)


@dataclass(frozen=True)
class RegularizationPoint:
    """The minimum of the cost for one weight of the prior."""

    #: α².
    regularization: float
    #: The cost at the minimum.
    cost: Cost
    #: How many parameters the data fit.
    effective_parameters: float
    #: Logarithm of the marginal likelihood, less the largest of all points; ≤ 0.
    log_evidence: float
    #: (n,), the minimum, in the parameters' units.
    map: Floats
    #: (n,), the standard deviations, in the parameters' units.
    std_dev: Floats
    #: Whether the minimizer converged.
    converged: bool


@dataclass(frozen=True)
class Choice:
    """What a rule chooses."""

    #: Whether the rule has an answer.
    determined: bool
    #: α²; 1 if the rule has no answer.
    regularization: float
    #: Why the rule has no answer; empty if it has one.
    reason: str


@dataclass(frozen=True)
class RegularizationSweep:
    """Estimates over the weight α² of the prior."""

    #: The uncertain parameters, in the problem's order.
    parameters: list[str]
    #: Their units.
    units: list[str]
    #: One point for each α², ascending.
    points: list[RegularizationPoint]
    #: The choices of the rules "L_CURVE", "DISCREPANCY" and "EVIDENCE".
    choices: dict[str, Choice]
    #: α² of the estimate.
    regularization: float
    #: Warnings, as of an estimate.
    diagnostics: list[Diagnostic]
    #: The session's last batch taken into account; 0 without one.
    sequence: int

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns a DataFrame with a row for each α² and parameter."""
        import pandas as pd

        return pd.DataFrame([
            {"regularization": point.regularization, "parameter": name, "unit": unit,
             "map": float(point.map[i]), "std_dev": float(point.std_dev[i]),
             "mismatch": point.cost.mismatch, "prior": point.cost.prior,
             "log_evidence": point.log_evidence, "converged": point.converged}
            for point in self.points
            for i, (name, unit) in enumerate(zip(self.parameters, self.units))])

    def plot(self) -> Figure:
        """Draws the L-curve: the prior's term over the mismatch. Returns a matplotlib figure."""
        from polyest import plot

        return plot.regularization(self)


def sweep_of(message: study_service_pb2.ComputeRegularizationSweepResponse) -> RegularizationSweep:
    """Returns a sweep as the daemon has sent it."""
    def choice(name: str) -> Choice:
        said = getattr(message, name)
        return Choice(said.determined, said.regularization, said.reason)

    points = [RegularizationPoint(
        one.regularization, Cost(one.cost.total, one.cost.mismatch, one.cost.prior),
        one.effective_parameters, one.log_evidence, array(one.map), array(one.std_dev),
        one.converged) for one in message.points]
    return RegularizationSweep(
        list(message.parameters), list(message.units), points,
        {name.upper(): choice(name) for name in ("l_curve", "discrepancy", "evidence")},
        message.regularization, [Diagnostic.of_message(one) for one in message.diagnostics],
        message.sequence)
