"""What the prior predicts, and which parameters the outputs depend on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from polyest._messages import array
from polyest._proto.v1 import study_service_pb2
from polyest._table import Floats
from polyest.estimate_parts import Diagnostic

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class ExpansionUsed:
    """The expansion that an answer rests on."""

    #: The order of the truncation.
    order: int
    #: Terms of the expansion.
    term_count: int
    #: Collocation points.
    point_count: int

    @classmethod
    def of_message(cls, message: study_service_pb2.ExpansionUsed) -> ExpansionUsed:
        """Returns the expansion as the daemon has sent it."""
        return cls(message.order, message.term_count, message.point_count)


@dataclass(frozen=True)
class PropagationOutput:
    """One output over T times, with P quantiles; values are in `unit`."""

    #: The output's name.
    name: str
    #: Its unit; "1" for a pure number, empty where the equations give none.
    unit: str
    #: (T,), the mean.
    mean: Floats
    #: (T,), the standard deviation.
    std_dev: Floats
    #: (T, P), the quantiles.
    quantiles: Floats
    #: (T,), the error of the numbers above: root mean square of model − expansion at draws of the
    #: prior, or the standard error of the draws' mean where `from_draws` is set.
    residual: Floats
    #: For each time the pair of (B,) centres of bins and (B,) densities; empty if not asked for.
    densities: list[tuple[Floats, Floats]]
    #: For each time, whether the numbers are those of the model at the draws, because the expansion
    #: does not follow it there.
    from_draws: list[bool]


@dataclass(frozen=True)
class Propagation:
    """What the prior predicts for the outputs over time."""

    #: (T,), s.
    time_s: Floats
    #: The outputs by name.
    outputs: dict[str, PropagationOutput]
    #: (P,), the probabilities of the quantiles.
    probabilities: Floats
    #: The expansion used.
    expansion: ExpansionUsed
    #: EXPANSION_INACCURATE and POINTS_FAILED where they apply.
    diagnostics: list[Diagnostic]
    #: Draws of the prior at which the model itself ran.
    draw_count: int

    def __getitem__(self, output: str) -> PropagationOutput:
        """Returns one output. Raises KeyError."""
        return self.outputs[output]

    def to_dataframe(self, output: str) -> pandas.DataFrame:
        """Returns one output with a row for each time."""
        import pandas as pd

        one = self.outputs[output]
        columns = {"mean": one.mean, "std_dev": one.std_dev,
                   **{f"q{probability:g}": one.quantiles[:, column]
                      for column, probability in enumerate(self.probabilities)},
                   "residual": one.residual}
        return pd.DataFrame(columns, index=pd.Index(self.time_s, name="t"))

    def plot(self) -> Figure:
        """Draws mean and outer quantiles over time. Returns a matplotlib figure."""
        from polyest import plot

        return plot.propagation(self)


def propagation_of(message: study_service_pb2.ComputePropagationResponse) -> Propagation:
    """Returns a propagation as the daemon has sent it."""
    shape = (len(message.time_s), len(message.probabilities))

    def output_of(one: Any) -> PropagationOutput:
        return PropagationOutput(
            one.name, one.unit, array(one.mean), array(one.std_dev), array(one.quantiles, *shape),
            array(one.residual),
            [(array(density.value), array(density.density)) for density in one.densities],
            list(one.from_draws))

    return Propagation(array(message.time_s),
                       {one.name: output_of(one) for one in message.outputs},
                       array(message.probabilities), ExpansionUsed.of_message(message.expansion),
                       [Diagnostic.of_message(one) for one in message.diagnostics],
                       message.draw_count)


@dataclass(frozen=True)
class SensitivityOutput:
    """How one output depends on n parameters over T times; values are in `unit`."""

    #: The output's name.
    name: str
    #: Its unit; "1" for a pure number, empty where the equations give none.
    unit: str
    #: (T,), the mean.
    mean: Floats
    #: (T,), the standard deviation.
    std_dev: Floats
    #: (T, n), share of the variance that each parameter causes alone, in [0, 1].
    first_order: Floats
    #: (T, n), share of the variance that involves each parameter, in [0, 1].
    total: Floats
    #: (T,), root mean square of model − expansion; shares hold where it is small beside std_dev.
    residual: Floats
    #: (T,), standard deviation of the noise of a sample.
    noise_std_dev: Floats


@dataclass(frozen=True)
class Sensitivity:
    """Which parameters the outputs depend on (Sobol' indices)."""

    #: (T,), s.
    time_s: Floats
    #: The uncertain parameters, in the problem's order.
    parameters: list[str]
    #: The outputs by name.
    outputs: dict[str, SensitivityOutput]
    #: (share of the variance, most change of one sample in noise) of each, the most active first.
    activity: dict[str, tuple[float, float]]
    #: The expansion used.
    expansion: ExpansionUsed
    #: Warnings, as of an estimate.
    diagnostics: list[Diagnostic]
    #: Draws of the prior at which the model itself ran.
    draw_count: int

    def __getitem__(self, output: str) -> SensitivityOutput:
        """Returns one output. Raises KeyError."""
        return self.outputs[output]

    def to_dataframe(self, output: str) -> pandas.DataFrame:
        """Returns one output with a row for each time and parameter."""
        import pandas as pd

        one = self.outputs[output]
        return pd.DataFrame({
            "t": self.time_s.repeat(len(self.parameters)),
            "parameter": self.parameters * len(self.time_s),
            "first_order": one.first_order.ravel(), "total": one.total.ravel()})

    def plot(self) -> Figure:
        """Draws the total shares over time. Returns a matplotlib figure."""
        from polyest import plot

        return plot.sensitivity(self)


def sensitivity_of(message: study_service_pb2.ComputeSensitivityResponse) -> Sensitivity:
    """Returns a sensitivity as the daemon has sent it."""
    shape = (len(message.time_s), len(message.parameters))

    def output_of(one: Any) -> SensitivityOutput:
        return SensitivityOutput(
            one.name, one.unit, array(one.mean), array(one.std_dev),
            array(one.first_order, *shape), array(one.total, *shape), array(one.residual),
            array(one.noise_std_dev))

    return Sensitivity(array(message.time_s), list(message.parameters),
                       {one.name: output_of(one) for one in message.outputs},
                       {one.parameter: (one.share, one.peak_to_noise)
                        for one in message.activity},
                       ExpansionUsed.of_message(message.expansion),
                       [Diagnostic.of_message(one) for one in message.diagnostics],
                       message.draw_count)
