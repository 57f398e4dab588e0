"""The JSON object of a problem: copies, its text, and bounds of priors that it lacks."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping
from typing import Any, Union

import numpy as np

from polyest import _strict_json
from polyest._proto.v1 import problem_pb2
from polyest._request import wrong
from polyest._table import refuse
from polyest.errors import InvalidInput, WrongType


def read(path: Union[str, os.PathLike[str]]) -> dict[str, Any]:
    """Reads a problem file. Raises InvalidInput if it is none, WrongType for what is no path."""
    # `open` takes a number for a descriptor, perhaps a connection's, and closes it in the end.
    if not isinstance(path, (str, os.PathLike)):
        raise WrongType("a problem must be a polyest.Problem, a dict, or the path of a problem "
                        f"file (str or os.PathLike); got {path!r} of the type "
                        f"{type(path).__name__}", field="problem")
    name = os.fsdecode(path)
    try:
        with open(path, "rb") as file:
            data = file.read()
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InvalidInput(f"{name}: cannot be opened: {why}".replace("\0", "\\0")) from error
    text = data.removeprefix(b"\xef\xbb\xbf").strip()
    if not text:
        raise InvalidInput(f"{name}: is empty; it must hold one JSON object, the problem")
    try:
        document = _strict_json.loads(data)
    except _strict_json.JsonError as error:
        first_line = text.partition(b"\n")[0].strip()
        if text[:1] not in b"{[" and (first_line == b"t" or re.search(b"[,;\t]", first_line)):
            raise InvalidInput(f"{name}: is CSV data; a problem is one JSON object") from None
        raise InvalidInput(f"{name}{error.place}: {error}", field=error.field,
                           rule=error.rule) from None
    if not isinstance(document, dict):
        raise InvalidInput(f"{name}: the file must hold one JSON object")
    return document


def copied(value: Any, path: str = "", depth: int = 0) -> Any:
    """Returns an independent copy with numpy's numbers and arrays as JSON has them.

    Raises InvalidInput for what is nested too deep, WrongType for a name that is no text.
    """
    if isinstance(value, np.ndarray):
        value = value.tolist()
    elif isinstance(value, np.generic):
        return value.item()
    if not isinstance(value, (Mapping, list, tuple)):
        return value
    if depth == _strict_json.MAX_DEPTH:
        raise InvalidInput("the problem: dicts and lists are nested more than "
                           f"{_strict_json.MAX_DEPTH} deep", field="problem")
    if isinstance(value, Mapping):
        for name in value:
            if not isinstance(name, str):
                raise wrong(path or "problem", name, "a text, as the name of a field")
        return {name: copied(part, f"{path}.{name}" if path else name, depth + 1)
                for name, part in value.items()}
    return [copied(part, f"{path}[{number}]", depth + 1) for number, part in enumerate(value)]


def text_of(document: Mapping[str, Any]) -> str:
    """Returns the text of a problem file. Raises InvalidInput for what JSON does not have."""
    plain = copied(document)
    try:
        return json.dumps(plain, indent=2, allow_nan=False, default=_refuse)
    except WrongType:
        raise
    except ValueError:
        path, value = next(_infinite(plain, ""))
        raise refuse(path, f"{value} must be a finite number") from None


def _infinite(value: Any, path: str) -> Any:
    """Yields the numbers that are not finite, each with its path."""
    if isinstance(value, float) and not math.isfinite(value):
        yield path, value
    elif isinstance(value, dict):
        for name, part in value.items():
            yield from _infinite(part, f"{path}.{name}" if path else name)
    elif isinstance(value, list):
        for number, part in enumerate(value):
            yield from _infinite(part, f"{path}[{number}]")


def _refuse(value: Any) -> None:
    raise WrongType(f"{value!r} of the type {type(value).__name__} is nothing that JSON has",
                    field="problem")


def check_bounds(document: Mapping[str, Any], message: problem_pb2.Problem, place: str) -> None:
    """Raises InvalidInput if a prior of a problem lacks a bound: to protobuf it would be 0.

    message: what the document holds. place: how the sentence of an error begins.
    """
    for number, parameter in enumerate(message.uncertain):
        kind = parameter.WhichOneof("prior")
        if kind not in ("uniform", "beta"):
            continue
        for bound in ("lower", "upper"):
            if bound not in document["uncertain"][number][kind]:
                field = f"uncertain[{number}].{kind}.{bound}"
                rule = (f"is missing; the {kind} prior of {parameter.name} needs lower and upper")
                raise InvalidInput(f"{place}{field}: {rule}", field=field, rule=rule)


def with_bounds(document: dict[str, Any], message: problem_pb2.Problem) -> dict[str, Any]:
    """Adds the bounds of priors that are 0 and that protobuf has therefore left out."""
    for entry, parameter in zip(document.get("uncertain", ()), message.uncertain):
        kind = parameter.WhichOneof("prior")
        if kind in ("uniform", "beta"):
            prior = getattr(parameter, kind)
            entry[kind].update(lower=prior.lower, upper=prior.upper)
    return document
