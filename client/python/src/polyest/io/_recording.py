"""Recordings: rows of a file or a bus in batches, each channel with samples at its own times."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Optional

import numpy as np

from polyest._proto.v1 import measurements_pb2
from polyest._table import Floats

if TYPE_CHECKING:
    import pandas

Measurements = measurements_pb2.Measurements


@dataclass(frozen=True)
class Batch:
    """Rows of measurements. `Session.append`, `Client.estimate` and all studies take it as data.

    A row has the samples of one time; NaN stands where a channel has none then. Streamed inputs
    are such channels, too: their samples are the input's own knots.
    """

    #: (n,), times of the rows, s, increasing.
    time_s: Floats
    #: (n,) each, by the problem's names, in `units`; NaN where there is no sample.
    values: dict[str, Floats]
    #: The unit of each channel; empty: that of the model. The daemon converts and checks them.
    units: dict[str, str] = field(default_factory=dict)
    #: The run of all rows, ≥ 0.
    run: int = 0

    def __len__(self) -> int:
        """Returns the number of rows."""
        return len(self.time_s)

    def measurements(self, units: Optional[Mapping[str, str]] = None, *,
                     end_of_run: bool = False) -> Measurements:
        """Returns the message for the daemon; `units` go before those of the batch."""
        message = Measurements(time_s=self.time_s, end_of_run=end_of_run)
        if self.run:
            message.run.extend([self.run] * len(self))
        for name, values in self.values.items():
            missing = np.isnan(values)
            unit = (units or {}).get(name, self.units.get(name, ""))
            message.channels.add(name=name, unit=unit,
                                 values=np.where(missing, 0.0, values) if missing.any() else values,
                                 missing=np.flatnonzero(missing))
        return message

    def to_dict(self) -> dict[str, Floats]:
        """Returns the columns: the time "t" and the channels."""
        return {"t": self.time_s, **self.values}

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns a pandas DataFrame whose index is the time `t`, s."""
        import pandas as pd

        return pd.DataFrame(self.values, index=pd.Index(self.time_s, name="t"))


class Recording:
    """Measurements of a file, which is read batch by batch each time that they are wanted.

    `for batch in recording` holds one batch at a time, and so does `session.append(recording)`, for
    files larger than the memory. `client.estimate(problem, recording)` sends all rows in one
    message. Raises InvalidInput where the file cannot be read.
    """

    def __init__(self, name: str, units: Mapping[str, str],
                 read: Callable[[], Iterator[Batch]]) -> None:
        """Use `polyest.io.mdf.read`, `polyest.io.mcap.read` or `polyest.io.can.read`."""
        #: The file's name.
        self.name = name
        #: The unit of each channel; empty: that of the model.
        self.units = dict(units)
        self._read = read

    def __iter__(self) -> Iterator[Batch]:
        """Yields the rows in batches, in the order of time."""
        return self._read()

    def all(self) -> Batch:
        """Returns all rows as one batch, which must fit into the memory."""
        batches = list(self)
        return Batch(np.concatenate([np.empty(0), *(one.time_s for one in batches)]),
                     {name: np.concatenate([np.empty(0), *(one.values[name] for one in batches)])
                      for name in self.units},
                     self.units, batches[0].run if batches else 0)

    def to_dict(self) -> dict[str, Floats]:
        """Returns all rows as columns: the time "t" and the channels; NaN is a missing sample."""
        return self.all().to_dict()

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns all rows as a pandas DataFrame whose index is the time `t`, s."""
        return self.all().to_dataframe()

    def __repr__(self) -> str:
        return f"<polyest.io.Recording '{self.name}' of {', '.join(self.units)}>"
