"""What drives a model: the inputs of a problem. Times in s, amplitudes in the input's unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Optional, Union

import numpy.typing as npt

from polyest._request import numbers

#: How a signal runs between its knots.
Interpolation = Literal["LINEAR", "CUBIC", "SHAPE_PRESERVING"]


@dataclass(frozen=True)
class Constant:
    """u(t) = amplitude."""

    amplitude: float

    def as_json(self) -> dict[str, Any]:
        """Returns the signal as it stands in a problem file."""
        return {"constant": {"amplitude": self.amplitude}}


@dataclass(frozen=True)
class Step:
    """0 before time_s, amplitude from then on."""

    amplitude: float
    time_s: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """Returns the signal as it stands in a problem file."""
        return {"step": {"amplitude": self.amplitude, "timeS": self.time_s}}


@dataclass(frozen=True)
class Sinusoid:
    """amplitude · sin(2π frequency_hz t + phase_rad); frequency_hz > 0."""

    amplitude: float
    frequency_hz: float
    phase_rad: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """Returns the signal as it stands in a problem file."""
        return {"sinusoid": {"amplitude": self.amplitude, "frequencyHz": self.frequency_hz,
                             "phaseRad": self.phase_rad}}


@dataclass(frozen=True)
class Chirp:
    """A linear sweep between two frequencies over duration_s > 0 from start_s on; 0 outside."""

    amplitude: float
    start_frequency_hz: float
    end_frequency_hz: float
    duration_s: float
    start_s: float = 0.0
    phase_rad: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """Returns the signal as it stands in a problem file."""
        return {"chirp": {"amplitude": self.amplitude, "startFrequencyHz": self.start_frequency_hz,
                          "endFrequencyHz": self.end_frequency_hz, "durationS": self.duration_s,
                          "startS": self.start_s, "phaseRad": self.phase_rad}}


@dataclass(frozen=True)
class HalfSineBump:
    """amplitude · sin(π (t − start_s)/duration_s) within the bump, 0 outside."""

    amplitude: float
    start_s: float
    duration_s: float

    def as_json(self) -> dict[str, Any]:
        """Returns the signal as it stands in a problem file."""
        return {"halfSineBump": {"amplitude": self.amplitude, "startS": self.start_s,
                                 "durationS": self.duration_s}}


@dataclass(frozen=True)
class Samples:
    """Knots at increasing times: `time_s` (N,) in s and `value` (N,) in the input's unit."""

    time_s: npt.ArrayLike
    value: npt.ArrayLike
    hold: bool = False
    amplitude: Optional[float] = None
    interpolation: Optional[Interpolation] = None

    def as_json(self) -> dict[str, Any]:
        """Returns the signal as it stands in a problem file."""
        table: dict[str, Any] = {"timeS": numbers("time_s", self.time_s).tolist(),
                                 "value": numbers("value", self.value).tolist()}
        return {"table": {**table, **_options(self.hold, self.amplitude, self.interpolation)}}


@dataclass(frozen=True)
class Streamed:
    """Values that come with the measurements, in a column of the input's name.

    `hold` keeps each value until the next sample; otherwise they are interpolated, CUBIC by
    default. `amplitude` multiplies the values.
    """

    hold: bool = False
    amplitude: Optional[float] = None
    interpolation: Optional[Interpolation] = None

    def as_json(self) -> dict[str, Any]:
        """Returns the signal as it stands in a problem file."""
        return {"streamed": _options(self.hold, self.amplitude, self.interpolation)}


def _options(hold: bool, amplitude: Optional[float],
             interpolation: Optional[Interpolation]) -> dict[str, Any]:
    options: dict[str, Any] = {"hold": True} if hold else {}
    if amplitude is not None:
        options["amplitude"] = amplitude
    if interpolation is not None:
        options["interpolation"] = interpolation
    return options


#: Any signal.
Signal = Union[Constant, Step, Sinusoid, Chirp, HalfSineBump, Samples, Streamed]
