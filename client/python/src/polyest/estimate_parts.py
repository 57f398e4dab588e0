"""The parts of an estimate. Numbers of a parameter are in its unit unless said otherwise."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Optional

from polyest._messages import enum_name
from polyest._proto.v1 import estimate_pb2


@dataclass(frozen=True)
class Parameter:
    """What is known of one parameter."""

    #: The name in the problem; with the run's number where each run has one: "x_0[1]".
    name: str
    #: The unit, such as "N/m"; "1" for a pure number, empty where the equations give none.
    unit: str
    #: The most probable value.
    map: float
    #: The standard deviation from the curvature of the cost at `map`, at most the prior's; that of
    #: the posterior where the two differ by a factor of 2 or more (NON_GAUSSIAN).
    std_dev: float
    #: The mean of the posterior.
    mean: float
    #: The 2.5 % quantile of the posterior.
    lower95: float
    #: The 97.5 % quantile of the posterior.
    upper95: float
    #: The mean of the prior.
    prior_mean: float
    #: The standard deviation of the prior.
    prior_std_dev: float
    #: std_dev ÷ prior_std_dev, a pure number in (0, 1].
    contraction: float
    #: "IDENTIFIED", "WEAK" or "NOT_IDENTIFIED".
    verdict: str
    #: The standard deviation of the posterior itself, whatever its shape.
    posterior_std_dev: float
    #: How far α² ≠ 1 moves `map`.
    bias: float
    #: The robust (sandwich) standard deviation; 0 if the record is too short.
    robust_std_dev: float

    @property
    def identified(self) -> bool:
        """Whether the data determine the parameter."""
        return self.verdict == "IDENTIFIED"

    @property
    def shown(self) -> tuple[float, float]:
        """The value that tables show and its standard deviation, as `polyest estimate` has them.

        That is `map` ± `std_dev`, and `mean` ± `posterior_std_dev` where the most probable value
        would mislead: where the data say less than the prior ("NOT_IDENTIFIED"), and where the
        posterior is twice as wide as the curvature says, as with several pieces.
        """
        unknown = self.verdict == "NOT_IDENTIFIED"
        wider = self.posterior_std_dev >= 2 * self.std_dev
        if self.posterior_std_dev > 0 and (unknown or wider):
            return self.mean, self.posterior_std_dev
        return self.map, self.std_dev

    def as_dict(self) -> dict[str, Any]:
        """Returns the fields by name."""
        return dataclasses.asdict(self)


def parameter_of(message: estimate_pb2.ParameterEstimate) -> Parameter:
    """Returns a parameter as the daemon has sent it."""
    names = [field.name for field in dataclasses.fields(Parameter) if field.name != "verdict"]
    return Parameter(verdict=enum_name(message, "verdict"),
                     **{name: getattr(message, name) for name in names})


@dataclass(frozen=True)
class Cost:
    """A value of the cost: total = mismatch + α² prior; pure numbers."""

    #: mismatch + α² prior.
    total: float
    #: How far the model is from the samples.
    mismatch: float
    #: How far the parameters are from what the prior prefers, not yet multiplied by α².
    prior: float


@dataclass(frozen=True)
class ChannelEstimate:
    """How well the model fits one measured output."""

    #: The output's name.
    output: str
    #: Samples taken into account.
    samples: int
    #: Σ (z − y)²/R at `map`; about `samples`, less the number of parameters fitted to them, when
    #: model and noise are right. Where outliers are handled, each counts as one unless there are
    #: too many of them to be gross errors.
    chi_squared: float
    #: Root mean square of the noise, assumed or estimated, in the output's unit.
    noise_std_dev: float
    #: Correlation of successive residuals, in [−1, 1]; about 0 when model and noise are right.
    lag1_correlation: float
    #: How many independent samples would tell as much.
    effective_samples: float
    #: Time constant of the noise's correlation, s; 0 where it is white.
    noise_time_constant_s: float
    #: Samples with less than half their weight.
    outliers: int
    #: Share of the noise's variance that is uncorrelated, where the rest is correlated.
    noise_white_share: float

    @classmethod
    def of_message(cls, message: estimate_pb2.ChannelEstimate) -> ChannelEstimate:
        """Returns a channel as the daemon has sent it."""
        return cls(**{field.name: getattr(message, field.name)
                      for field in dataclasses.fields(cls)})


@dataclass(frozen=True)
class Direction:
    """A direction in the space of the parameters."""

    #: The data's information ÷ the prior's, ≥ 0; a pure number.
    information: float
    #: A unit vector over the parameters, each measured in its prior standard deviations.
    coefficients: dict[str, float]
    #: "IDENTIFIED", "WEAK" or "NOT_IDENTIFIED".
    verdict: str


@dataclass(frozen=True)
class ExpansionSummary:
    """The expansion that an estimate rests on."""

    #: The order of the truncation.
    order: int
    #: Terms of the expansion.
    terms: int
    #: Collocation points.
    points: int
    #: Root mean square of (model − expansion) ÷ noise; small beside 1 if it can be trusted.
    residual_to_noise: float
    #: How often the outputs were expanded again where the posterior is.
    reexpansions: int
    #: Runs of the model in all.
    trajectories: int
    #: Shape k̂ of the largest importance weights; above 0.7 is bad. None: too few particles, or these
    #: no longer represent the posterior and the expansion is as good as the model.
    pareto_shape: Optional[float]

    @classmethod
    def of_message(cls, message: estimate_pb2.ExpansionSummary) -> ExpansionSummary:
        """Returns the expansion as the daemon has sent it."""
        return cls(message.order, message.terms, message.points, message.residual_to_noise,
                   message.reexpansions, message.trajectories,
                   message.pareto_shape if message.HasField("pareto_shape") else None)


@dataclass(frozen=True)
class Diagnostic:
    """A warning about an answer."""

    #: The kind of warning, such as "MODEL_MISFIT".
    code: str
    #: The warning in one sentence, with the parameter and the numbers concerned.
    message: str

    @classmethod
    def of_message(cls, message: estimate_pb2.Diagnostic) -> Diagnostic:
        """Returns a warning as the daemon has sent it."""
        return cls(enum_name(message, "code"), message.message)

    def __str__(self) -> str:
        return f"{self.code}: {self.message}"


@dataclass(frozen=True)
class TradeOff:
    """Two parameters that the data cannot tell apart."""

    #: The name of one.
    first: str
    #: The name of the other.
    second: str
    #: The combination that is known, such as "k/m".
    combination: str
    #: Standard deviation of the combination ÷ |its mean|; a pure number.
    relative_std_dev: float
    #: Standard deviation ÷ |mean| of the first alone.
    first_alone: float
    #: Standard deviation ÷ |mean| of the second alone.
    second_alone: float


@dataclass(frozen=True)
class MixtureComponent:
    """One piece of a posterior in several pieces."""

    #: The posterior's probability of this piece, in (0, 1].
    weight: float
    #: The parameters of this piece alone, in the problem's order.
    parameters: list[Parameter]


@dataclass(frozen=True)
class WindowEstimate:
    """What the samples of one window of the record and the prior alone say."""

    #: The run of the window's first row.
    first_run: int
    #: The run of the window's last row.
    last_run: int
    #: Time of the window's first row in its run, s.
    start_time_s: float
    #: Time of the window's last row in its run, s.
    end_time_s: float
    #: (value, standard deviation) of each parameter that the window identifies, by name.
    values: dict[str, tuple[float, float]]

    @classmethod
    def of_message(cls, message: estimate_pb2.WindowEstimate) -> WindowEstimate:
        """Returns a window as the daemon has sent it."""
        return cls(message.first_run, message.last_run, message.start_time_s, message.end_time_s,
                   {one.parameter: (one.value, one.std_dev) for one in message.values})


@dataclass(frozen=True)
class FilteredQuantity:
    """A state of the model or the present value of a parameter that drifts."""

    #: The name of the state or parameter.
    name: str
    #: Its unit; "1" for a pure number.
    unit: str
    #: The mean of its distribution, in `unit`.
    mean: float
    #: The standard deviation of its distribution, in `unit`.
    std_dev: float
    #: The 2.5 % quantile of its distribution, in `unit`.
    lower95: float
    #: The 97.5 % quantile of its distribution, in `unit`.
    upper95: float

    @classmethod
    def of_message(cls, message: estimate_pb2.FilteredQuantity) -> FilteredQuantity:
        """Returns a quantity as the daemon has sent it."""
        return cls(message.name, message.unit, message.mean, message.std_dev, message.lower95,
                   message.upper95)
