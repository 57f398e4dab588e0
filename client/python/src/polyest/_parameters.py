"""What the parameters of a problem are called in its estimates."""

from __future__ import annotations

import re
from collections.abc import Iterator

from polyest._proto.v1 import problem_pb2

_RUN = re.compile(r"\[\d+\]$")


def without_run(name: str) -> str:
    """Returns a name without the number of a run: "x_0" for "x_0[1]"."""
    return _RUN.sub("", name)


class ParameterNames:
    """The names that the estimates of a problem may have.

    `in` tells whether there is one; an iteration has run 0 for all runs.
    """

    def __init__(self, problem: problem_pb2.Problem) -> None:
        self._shared: list[str] = []
        self._of_runs: list[str] = []
        for one in problem.uncertain:
            if one.population:
                middle = "mean" if one.HasField("normal") else "median"
                self._shared += [f"{one.name}.{middle}", f"{one.name}.spread"]
            (self._of_runs if one.per_run else self._shared).append(one.name)
            if one.drift.random_walk.unknown:
                self._shared.append(f"{one.name}.drift")
        self._shared += [f"processNoise.{one.state}" for one in problem.process_noise
                         if one.unknown]

    def __contains__(self, name: object) -> bool:
        """Whether a parameter may have this name."""
        return name in self._shared or (isinstance(name, str) and _RUN.search(name) is not None
                                        and without_run(name) in self._of_runs)

    def __iter__(self) -> Iterator[str]:
        """Goes through the names."""
        yield from (f"{name}[0]" for name in self._of_runs)
        yield from self._shared
