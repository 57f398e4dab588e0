"""What is known of an uncertain quantity before the measurements.

All numbers are in the quantity's unit unless said otherwise. The daemon checks them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional, Union


@dataclass(frozen=True)
class Uniform:
    """All values between two bounds are equally likely; lower < upper."""

    lower: float
    upper: float

    def as_json(self) -> dict[str, Any]:
        """Returns the prior as it stands in a problem file."""
        return {"uniform": {"lower": self.lower, "upper": self.upper}}


@dataclass(frozen=True)
class Normal:
    """A normal distribution; std_dev > 0."""

    mean: float
    std_dev: float

    def as_json(self) -> dict[str, Any]:
        """Returns the prior as it stands in a problem file."""
        return {"normal": {"mean": self.mean, "stdDev": self.std_dev}}


@dataclass(frozen=True)
class Beta:
    """Density ∝ (x − lower)^(alpha − 1) (upper − x)^(beta − 1); alpha, beta in 1 … 10,000."""

    alpha: float
    beta: float
    lower: float = 0.0
    upper: float = 1.0

    def as_json(self) -> dict[str, Any]:
        """Returns the prior as it stands in a problem file."""
        return {"beta": {"alpha": self.alpha, "beta": self.beta, "lower": self.lower,
                         "upper": self.upper}}


@dataclass(frozen=True)
class Gamma:
    """shift + scale·X with X ~ Gamma(shape, 1); shape in 1 … 10,000, scale > 0."""

    shape: float
    scale: float
    shift: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """Returns the prior as it stands in a problem file."""
        return {"gamma": {"shape": self.shape, "scale": self.scale, "shift": self.shift}}


@dataclass(frozen=True)
class Lognormal:
    """exp of a normal variable; mean > 0 and std_dev > 0 are those of the quantity itself."""

    mean: float
    std_dev: float

    def as_json(self) -> dict[str, Any]:
        """Returns the prior as it stands in a problem file."""
        return {"lognormal": {"mean": self.mean, "stdDev": self.std_dev}}


@dataclass(frozen=True)
class TruncatedNormal:
    """A normal density cut off outside of the bounds, of which at least one is given.

    mean and std_dev are those before the cut.
    """

    mean: float
    std_dev: float
    lower: Optional[float] = None
    upper: Optional[float] = None

    def as_json(self) -> dict[str, Any]:
        """Returns the prior as it stands in a problem file."""
        bounds = {name: bound for name, bound in (("lower", self.lower), ("upper", self.upper))
                  if bound is not None}
        return {"truncatedNormal": {"mean": self.mean, "stdDev": self.std_dev, **bounds}}


#: Any prior.
Prior = Union[Uniform, Normal, Beta, Gamma, Lognormal, TruncatedNormal]
