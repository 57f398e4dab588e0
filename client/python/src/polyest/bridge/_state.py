"""What a bridge must know to go on with a run after it was started again: what t = 0 is."""

from __future__ import annotations

import json
import os
import pathlib
from dataclasses import dataclass
from typing import Optional

from polyest._table import refuse


@dataclass(frozen=True)
class RunState:
    """The run that a bridge was in."""

    #: The session's name.
    session: str
    #: The number of the run.
    run: int
    #: The time of t = 0, ns.
    origin_ns: int


class StateFile:
    """Keeps the state in a file, which is replaced as a whole."""

    def __init__(self, path: str) -> None:
        """Without a path nothing is kept."""
        self._path = path
        self._written: Optional[RunState] = None

    def read(self, session: str) -> Optional[RunState]:
        """Returns the state of a session; None if none is kept. Raises InvalidInput."""
        if not self._path or not os.path.exists(self._path):
            return None
        try:
            found = RunState(**json.loads(pathlib.Path(self._path).read_text(encoding="utf-8")))
            if [type(value) for value in vars(found).values()] != [str, int, int]:
                raise TypeError(f"{vars(found)} has values of other types")
        except (OSError, ValueError, TypeError) as error:
            raise refuse("session.state", f"{self._path} cannot be read: {error}; without it the "
                         "bridge begins a new run") from error
        return found if found.session == session else None

    def write(self, state: RunState) -> None:
        """Keeps a state, unless it is kept already. Raises OSError."""
        if not self._path or state == self._written:
            return
        new = f"{self._path}.new"
        with open(new, "w", encoding="utf-8") as file:
            json.dump(vars(state), file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, self._path)
        self._written = state

    def forget(self) -> None:
        """Removes the state: the next bridge begins a new run."""
        if self._path:
            pathlib.Path(self._path).unlink(missing_ok=True)
