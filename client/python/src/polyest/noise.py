"""How large the errors of samples are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Optional, Union

from polyest._request import number
from polyest._table import refuse


@dataclass(frozen=True)
class Noise:
    """The errors of the samples z of one measured output.

    Their standard deviation is absolute + relative·|z| + relative_to_max·max|z|, in the output's
    unit. With `unknown`, it is estimated, and the numbers may be left out.
    """

    #: The constant part, in the output's unit, ≥ 0.
    absolute: float = 0.0
    #: The part proportional to the sample, as a fraction of it, ≥ 0.
    relative: float = 0.0
    #: The part proportional to the largest sample so far or to the full scale, as a fraction, ≥ 0.
    relative_to_max: float = 0.0
    #: Whether the size is estimated with the parameters.
    unknown: bool = False
    #: Time constant of the correlation of successive errors, s, > 0; "auto" estimates it.
    correlation: Union[float, Literal["auto"], None] = None
    #: Share of the variance that is uncorrelated, ≥ 0 and < 1; with a given time constant only.
    white_share: float = 0.0
    #: What is done about gross errors.
    outliers: Optional[Literal["NONE", "STUDENT_T", "HUBER"]] = None
    #: The full scale of the sensor, in the output's unit, > 0; None: the largest sample so far.
    full_scale: Optional[float] = None

    def __post_init__(self) -> None:
        """Raises InvalidInput for what a problem file cannot say; the daemon checks the rest."""
        for name in ("absolute", "relative", "relative_to_max", "white_share"):
            number(name, getattr(self, name))
        if self.correlation not in (None, "auto"):
            number("correlation", self.correlation, 'a number, "auto" or None')
        if self.full_scale is not None and not number("full_scale", self.full_scale) > 0:
            raise refuse("full_scale", f"{self.full_scale} must be > 0; None stands for the "
                         "largest sample so far")
        if self.white_share and self.correlation is None:
            raise refuse("white_share", "is a share of correlated noise, and correlation is None")

    def as_json(self) -> dict[str, Any]:
        """Returns the noise as it stands in a problem file."""
        noise: dict[str, Any] = {}
        for name, value in (("absolute", self.absolute), ("relative", self.relative),
                            ("relativeToMax", self.relative_to_max), ("unknown", self.unknown),
                            ("outliers", self.outliers), ("fullScale", self.full_scale)):
            if value:
                noise[name] = value
        if self.correlation is not None:
            noise["correlation"] = ({"auto": True} if self.correlation == "auto"
                                    else {"timeConstantS": self.correlation})
            if self.white_share:
                noise["correlation"]["whiteShare"] = self.white_share
        return noise
