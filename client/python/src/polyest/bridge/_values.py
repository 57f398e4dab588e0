"""Picks the values of an estimate that are published: one by a path such as "k.mean", or all."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from polyest import _html
from polyest._parameters import ParameterNames
from polyest._table import refuse
from polyest.estimates import Estimate
from polyest.io._choices import unknown

# What a path may name of the estimate as a whole, as in "time".
_WHOLE: dict[str, Callable[[Estimate], float]] = {
    "time": lambda estimate: estimate.time,
    "samples": lambda estimate: estimate.samples,
    "sequence": lambda estimate: estimate.sequence,
    "diagnostics": lambda estimate: len(estimate.diagnostics),
}
# What a path may name of each parameter, as in "k.mean".
_OF_PARAMETER = ("mean", "std_dev", "map", "lower95", "upper95", "contraction", "identified")


def check_path(field: str, path: str, names: ParameterNames) -> None:
    """Raises InvalidInput unless there is such a value; `names` are the problem's parameters."""
    if path in _WHOLE:
        return
    name, _, what = path.rpartition(".")
    if what not in _OF_PARAMETER or not name:
        raise refuse(field, f"'{path}' is no value of an estimate: those are PARAMETER."
                     f"{'|'.join(_OF_PARAMETER)}, {', '.join(_WHOLE)}")
    if name not in names:
        raise unknown(field, "uncertain parameter", name, names)


def value_of(estimate: Estimate, path: str) -> float:
    """Returns a value of an estimate. Raises KeyError if a run has no such parameter yet."""
    if path in _WHOLE:
        return float(_WHOLE[path](estimate))
    name, _, what = path.rpartition(".")
    return float(getattr(estimate[name], what))


def in_words(estimate: Estimate) -> str:
    """Returns the values that tables show, as in "k = 41.298 ± 0.003, c = 0.230 ± 0.001"."""
    return ", ".join(f"{one.name} = {_html.uncertain(*one.shown)}" for one in estimate)


def as_json(session: str, estimate: Estimate) -> dict[str, Any]:
    """Returns what subscribers need of an estimate."""
    return {"session": session, "time": estimate.time, "samples": estimate.samples,
            "sequence": estimate.sequence,
            "parameters": {one.name: {
                "mean": one.mean, "stdDev": one.std_dev, "lower95": one.lower95,
                "upper95": one.upper95, "unit": one.unit, "verdict": one.verdict}
                for one in estimate},
            "diagnostics": [one.code for one in estimate.diagnostics]}
