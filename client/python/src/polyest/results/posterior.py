"""The posterior in detail: densities, quantiles and samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polyest._messages import array, enum_name
from polyest._proto.v1 import study_service_pb2
from polyest._table import Floats, Integers
from polyest.estimate_parts import Diagnostic
from polyest.results import convergence

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Marginal:
    """The posterior of one parameter; values are in `unit`."""

    #: The parameter's name.
    name: str
    #: Its unit; "1" for a pure number, empty where the equations give none.
    unit: str
    #: Its mean.
    mean: float
    #: Its standard deviation.
    std_dev: float
    #: (P,), one quantile for each probability.
    quantiles: Floats
    #: (B,), centres of the bins over the central 99.9 %.
    value: Floats
    #: (B,), the density in each bin, in 1/unit.
    density: Floats
    #: Number of independent draws that would tell as much.
    effective_sample_size: float
    #: Rank-normalized split R̂, near 1 when the chains agree; NaN for importance sampling.
    r_hat: float


@dataclass(frozen=True)
class Joint:
    """The posterior of two parameters."""

    #: The name of the first parameter.
    first: str
    #: The name of the second parameter.
    second: str
    #: (F,), centres of the bins of the first parameter, in its unit.
    first_value: Floats
    #: (S,), centres of the bins of the second parameter, in its unit.
    second_value: Floats
    #: (F, S), the density, in 1/(unit of the first · unit of the second).
    density: Floats


@dataclass(frozen=True)
class Posterior:
    """The posterior of n parameters; `posterior["k"]` is the marginal of one."""

    #: The marginals by name, in the problem's order.
    parameters: dict[str, Marginal]
    #: (P,), the probabilities of the quantiles.
    probabilities: Floats
    #: The joint densities asked for.
    joints: list[Joint]
    #: (samples, n), equally weighted, in the parameters' units.
    samples: Floats
    #: (samples,), the group of Markov chains that each sample is of, 0, 0, …, 1, …, as often as the
    #: others to within one; empty for importance sampling. Groups never exchange anything.
    sample_chains: Integers
    #: "IMPORTANCE_SAMPLING" or "MARKOV_CHAINS".
    method: str
    #: Number of draws that the answer is computed from.
    draw_count: int
    #: Number of independent draws that would tell as much: the least of the parameters'.
    effective_sample_size: float
    #: The largest R̂ of the parameters; NaN for importance sampling, which has no chains.
    r_hat: float
    #: Warnings, as of an estimate.
    diagnostics: list[Diagnostic]
    #: Time of the last measurement, s.
    time_s: float
    #: The session's last batch taken into account; 0 without one.
    sequence: int

    def __getitem__(self, name: str) -> Marginal:
        """Returns the marginal of a parameter. Raises KeyError."""
        return self.parameters[name]

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.parameters)

    def convergence(self) -> convergence.Convergence:
        """Returns R̂ and effective sample size of each parameter, as a table.

        R̂ is NaN for importance sampling, whose draws form no chains.
        """
        return convergence.of_posterior(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns the samples as a DataFrame with a column for each parameter."""
        import pandas as pd

        return pd.DataFrame(self.samples, columns=list(self.parameters))

    def plot(self) -> Figure:
        """Draws marginal and joint densities. Returns a matplotlib figure."""
        from polyest import plot

        return plot.corner(self)


def of_message(message: study_service_pb2.ComputePosteriorResponse) -> Posterior:
    """Returns a posterior as the daemon has sent it, whose R̂ is 0 where there are no chains."""
    method = enum_name(message, "method")

    def r_hat(sent: float) -> float:
        return sent if method == "MARKOV_CHAINS" else math.nan

    return Posterior(
        parameters={one.name: Marginal(one.name, one.unit, one.mean, one.std_dev,
                                       array(one.quantiles), array(one.value), array(one.density),
                                       one.effective_sample_size, r_hat(one.r_hat))
                    for one in message.parameters},
        probabilities=array(message.probabilities),
        joints=[Joint(one.first, one.second, array(one.first_value), array(one.second_value),
                      array(one.density, len(one.first_value), len(one.second_value)))
                for one in message.joints],
        samples=array(message.samples).reshape(-1, max(len(message.parameters), 1)),
        sample_chains=np.fromiter(message.sample_chains, dtype=np.int64),
        method=method, draw_count=message.draw_count,
        effective_sample_size=message.effective_sample_size, r_hat=r_hat(message.r_hat),
        diagnostics=[Diagnostic.of_message(one) for one in message.diagnostics],
        time_s=message.time_s, sequence=message.sequence)
