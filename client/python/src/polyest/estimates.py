"""Estimates: what is known of the parameters after the measurements."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from polyest import _html
from polyest._messages import array, enum_name, to_dict
from polyest._proto.v1 import estimate_pb2
from polyest._table import Floats
from polyest.estimate_parts import (
    ChannelEstimate,
    Cost,
    Diagnostic,
    Direction,
    ExpansionSummary,
    FilteredQuantity,
    MixtureComponent,
    Parameter,
    TradeOff,
    WindowEstimate,
    parameter_of,
)

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from polyest.studies import Studies


@dataclass(frozen=True)
class Estimate:
    """What is known of the uncertain parameters.

    `estimate["k"]` is one parameter; `estimate.names` are all. Numbers are in their units.
    Warnings about the result are in `diagnostics`: look there before you trust the numbers.
    """

    #: The uncertain parameters, in the problem's order.
    parameters: list[Parameter]
    #: (n, n), from the curvature of the cost at `map`, in the products of the units.
    covariance: Floats
    #: The cost at `map`.
    cost: Cost
    #: How well the model fits each measured output, in the problem's order.
    channels: list[ChannelEstimate]
    #: Directions in the space of the parameters, the most informed first.
    directions: list[Direction]
    #: The expansion that the estimate rests on.
    expansion: ExpansionSummary
    #: Warnings; empty: all is well.
    diagnostics: list[Diagnostic]
    #: Time of the last sample, s.
    time: float
    #: Values taken into account, over all channels and runs.
    samples: int
    #: The session's last batch taken into account; 0 where there are no batches.
    sequence: int
    #: The α² used, the weight of the prior.
    regularization: float
    #: Pairs of parameters of which only a combination is known well.
    trade_offs: list[TradeOff]
    #: The pieces of a posterior in several pieces, heaviest first; empty when there is one piece.
    components: list[MixtureComponent]
    #: How much more windows of the record scatter than the noise explains; 0: too short to say.
    disagreement: float
    #: What windows of the record say on their own; empty unless they disagree.
    windows: list[WindowEstimate]
    #: With process noise or drift: the states and the parameters that drift, at `time`.
    filtered: list[FilteredQuantity]
    #: The message of the daemon.
    message: estimate_pb2.Estimate
    _source: Optional[Studies] = None

    def __getitem__(self, name: str) -> Parameter:
        """Returns a parameter by its name. Raises KeyError, which names those that exist."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(f"no parameter '{name}'; there are {', '.join(self.names)}")

    def __iter__(self) -> Iterator[Parameter]:
        """Goes through the parameters."""
        return iter(self.parameters)

    def __len__(self) -> int:
        """Returns the number of parameters."""
        return len(self.parameters)

    def __contains__(self, name: object) -> bool:
        """Returns whether there is a parameter of this name."""
        return name in self.names

    def _ipython_key_completions_(self) -> list[str]:
        return self.names

    @property
    def names(self) -> list[str]:
        """The names of the parameters, in the problem's order."""
        return [parameter.name for parameter in self.parameters]

    @property
    def map(self) -> Floats:
        """(n,), the most probable values."""
        return np.array([parameter.map for parameter in self.parameters])

    @property
    def std_dev(self) -> Floats:
        """(n,), the standard deviations."""
        return np.array([parameter.std_dev for parameter in self.parameters])

    @property
    def correlation(self) -> Floats:
        """(n, n), `covariance` as correlations; pure numbers."""
        scale = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore", divide="ignore"):
            result: Floats = self.covariance / np.outer(scale, scale)
        return result

    def has(self, code: str) -> bool:
        """Returns whether a diagnostic, such as "MODEL_MISFIT", is raised."""
        return any(diagnostic.code == code for diagnostic in self.diagnostics)

    def to_dict(self) -> dict[str, Any]:
        """Returns what `polyest estimate --format json` prints."""
        result = to_dict(self.message)
        for direction in result["directions"]:
            # A list of pairs in the contract, and a map wherever it is printed.
            direction["coefficients"] = {one["parameter"]: one["value"]
                                         for one in direction["coefficients"]}
        return result

    def to_json(self) -> str:
        """Returns `to_dict` as text."""
        return json.dumps(self.to_dict(), indent=2, ensure_ascii=False)

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns a pandas DataFrame with a row for each parameter; its index is the name."""
        import pandas as pd

        return pd.DataFrame([parameter.as_dict() for parameter in self.parameters]
                            ).set_index("name")

    def _rows(self) -> list[tuple[str, ...]]:
        return [(one.name, _html.uncertain(*one.shown), one.unit,
                 _html.interval(one.lower95, one.upper95),
                 _html.uncertain(one.prior_mean, one.prior_std_dev),
                 _html.number(one.shown[1] / one.prior_std_dev, 2), one.verdict) for one in self.parameters]

    _HEADER = ("parameter", "estimate ± sd", "unit", "95 % interval", "prior", "sd/prior",
               "verdict")

    def __repr__(self) -> str:
        rows = [(*row[:-1], _html.words(row[-1])) for row in self._rows()]
        lines = [f"{self.samples} samples up to t = {_html.number(self.time)} s",
                 _html.text_table(self._HEADER, rows)]
        lines += [f"{diagnostic.code}: {diagnostic.message}" for diagnostic in self.diagnostics]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        channels = [(one.output, str(one.samples), _html.number(one.chi_squared, 4),
                     _html.number(one.noise_std_dev, 3), _html.number(one.effective_samples, 4))
                    for one in self.channels]
        parts = [_html.paragraph(f"{self.samples} samples up to t = {_html.number(self.time)} s"),
                 _html.table(self._HEADER, self._rows()),
                 _html.table(("channel", "samples", "χ²", "noise sd", "effective"), channels)]
        parts += [_html.table(("warning", ""), [(one.code, one.message)
                                                for one in self.diagnostics])
                  if self.diagnostics else ""]
        return _html.page(*parts)

    def _studies(self) -> Studies:
        if self._source is None:
            raise ValueError("this estimate does not know its measurements; use polyest.plot with "
                             "the prediction, posterior or history of the session or experiment")
        return self._source

    def plot(self) -> Figure:
        """Draws each parameter's prior and posterior interval. Returns a matplotlib figure."""
        from polyest import plot

        return plot.estimate(self)

    def plot_fit(self, **options: Any) -> Figure:
        """Draws the samples, the prediction and its 95 % bands; options as `Studies.predict`."""
        from polyest import plot

        return plot.fit(self._studies().predict(**options))

    def plot_residuals(self, **options: Any) -> Figure:
        """Draws the standardized residuals and their autocorrelation."""
        from polyest import plot

        return plot.residuals(self._studies().predict(**options))

    def plot_history(self) -> Figure:
        """Draws how the estimates came about, with their 95 % intervals, over time."""
        from polyest import plot

        return plot.history(self._studies().history())

    def plot_corner(self, **options: Any) -> Figure:
        """Draws marginal and joint densities of the posterior; options as `Studies.posterior`."""
        from polyest import plot

        return plot.corner(self._studies().posterior(all_joints=True, **options))

    def to_datatree(self, **options: Any) -> Any:
        """Returns an xarray.DataTree for ArviZ; see `polyest.datatree.of_studies`."""
        from polyest import datatree

        return datatree.of_studies(self._studies(), **options)


def of_message(message: estimate_pb2.Estimate, source: Optional[Studies] = None) -> Estimate:
    """Returns an estimate as the daemon has sent it."""
    count = len(message.parameters)
    return Estimate(
        parameters=[parameter_of(one) for one in message.parameters],
        covariance=array(message.covariance).reshape(
            (count, count) if len(message.covariance) == count * count else (-1,)),
        cost=Cost(message.cost.total, message.cost.mismatch, message.cost.prior),
        channels=[ChannelEstimate.of_message(one) for one in message.channels],
        directions=[Direction(one.information, {part.parameter: part.value
                                                for part in one.coefficients},
                              enum_name(one, "verdict")) for one in message.directions],
        expansion=ExpansionSummary.of_message(message.expansion),
        diagnostics=[Diagnostic.of_message(one) for one in message.diagnostics],
        time=message.time, samples=message.samples, sequence=message.sequence,
        regularization=message.regularization,
        trade_offs=[TradeOff(one.first, one.second, one.combination, one.relative_std_dev,
                             one.first_alone, one.second_alone) for one in message.trade_offs],
        components=[MixtureComponent(one.weight, [parameter_of(part) for part in one.parameters])
                    for one in message.components],
        disagreement=message.disagreement,
        windows=[WindowEstimate.of_message(one) for one in message.windows],
        filtered=[FilteredQuantity.of_message(one) for one in message.filtered],
        message=message, _source=source)
