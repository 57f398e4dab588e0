"""Problems: what is estimated, from what, with which prior."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, Optional, TypeVar, Union

from google.protobuf import json_format

from polyest import _documents, _parsing
from polyest._files import file_error, path_of
from polyest._proto.v1 import problem_pb2
from polyest._request import json_of, mapping, number, numbers, pair, wrong
from polyest.errors import InvalidInput
from polyest.noise import Noise
from polyest.priors import Prior
from polyest.signals import Interpolation, Signal, Streamed

if TYPE_CHECKING:
    from polyest._table import Data
    from polyest.check import Check
    from polyest.client import Client


Part = TypeVar("Part", dict[str, Any], list[Any])


class Problem:
    """A problem, built step by step.

    Every method that adds something returns the problem, so that calls can be chained:

        problem = (polyest.Problem.builtin("mass_spring_damper")
                   .fix(m=1.0, x0=1.0)
                   .uncertain("k", polyest.Uniform(31.6, 47.4))
                   .measure("x", noise=0.01))

    Values are in the model's units. Names are checked by the daemon (`check`, and every call that
    takes a problem), whose messages are those of the command line.
    """

    def __init__(self, document: Optional[Mapping[str, Any]] = None) -> None:
        """`document` is a problem file's JSON object; by default an empty problem."""
        given = {} if document is None else mapping("document", document, "a problem file's object")
        self._document: dict[str, Any] = _documents.copied(given)

    @classmethod
    def builtin(cls, name: str) -> Problem:
        """Returns a problem of a built-in model; `Client.models` lists them."""
        return cls({"model": {"builtin": name}})

    @classmethod
    def fmu(cls, name: str) -> Problem:
        """Returns a problem of an FMU in the daemon's folder, without ".fmu"."""
        return cls({"model": {"fmu": name}})

    @classmethod
    def umbridge(cls, name: str) -> Problem:
        """Returns a problem of a model of UM-Bridge servers, described in the daemon's folder."""
        return cls({"model": {"umbridge": name}})

    @classmethod
    def equations(cls, *, states: Mapping[str, str], outputs: Mapping[str, str],
                  parameters: Optional[Mapping[str, float]] = None, inputs: Sequence[str] = (),
                  units: Optional[Mapping[str, str]] = None,
                  intermediates: Optional[Mapping[str, str]] = None,
                  tables: Optional[Mapping[str, tuple[Sequence[float], Sequence[float]]]] = None
                  ) -> Problem:
        """Returns a problem of a model given by its equations.

        `states` has the time derivative of each state, `outputs` the expression of each output,
        `parameters` defaults, `units` units by name. A state's initial value is `<state>_0`.
        `tables` has the points of functions of one argument: their places and their values.
        """
        equations: dict[str, Any] = {"states": mapping("states", states),
                                     "outputs": mapping("outputs", outputs)}
        for name, value in (("parameters", parameters), ("units", units),
                            ("intermediates", intermediates)):
            if value:
                equations[name] = mapping(name, value)
        if inputs:
            equations["inputs"] = ([inputs] if isinstance(inputs, str) or not isinstance(inputs, Iterable)
                                   else list(inputs))
        if tables:
            equations["tables"] = {name: _points(f"tables.{name}", points)
                                   for name, points in mapping("tables", tables).items()}
        return cls({"model": {"equations": equations}})

    @classmethod
    def read(cls, path: Union[str, os.PathLike[str]]) -> Problem:
        """Reads a problem file. Raises InvalidInput if it is no problem."""
        return cls(_documents.read(path))

    def fix(self, values: Optional[Mapping[str, float]] = None, **named: float) -> Problem:
        """Gives parameters, initial states, … known values, in the model's units."""
        known = {} if values is None else mapping("values", values, "numbers by name")
        self._object("fixed").update({**known, **named})
        return self

    def uncertain(self, name: str, prior: Prior, *, per_run: bool = False,
                  drift: Union[float, tuple[float, float], None] = None,
                  population: bool = False) -> Problem:
        """Makes a quantity uncertain; with `per_run` each run of the record has its own value.

        With `population`, too, the runs' values belong to a population, which is estimated.
        `drift` makes it a random walk: its rate in the quantity's unit/√s, or the bounds of an
        unknown rate, which is then estimated, too.
        """
        known = json_of("prior", prior, "a prior, such as polyest.Uniform(1, 2)")
        entry: dict[str, Any] = {"name": name, **known}
        if per_run:
            entry["perRun"] = True
        if population:
            entry["population"] = True
        if isinstance(drift, tuple):
            lower, upper = pair("drift", drift)
            entry["drift"] = {"randomWalk": {"unknown": True, "lower": lower, "upper": upper}}
        elif drift is not None:
            entry["drift"] = {"randomWalk": {"stdDevPerSqrtS": drift}}
        self._list("uncertain").append(entry)
        return self

    def process_noise(self, state: str,
                      spectral_density: Union[float, tuple[float, float]]) -> Problem:
        """Drives a state of the model with white noise, for what an imperfect model leaves out.

        Its spectral density is in (unit of the state)²/s; the bounds of an unknown one make it
        another uncertain parameter.
        """
        entry: dict[str, Any] = {"state": state}
        if isinstance(spectral_density, tuple):
            lower, upper = pair("spectral_density", spectral_density)
            entry.update(unknown=True, lower=lower, upper=upper)
        else:
            entry["spectralDensity"] = spectral_density
        self._list("processNoise").append(entry)
        return self

    def correlate(self, first: str, second: str, coefficient: float) -> Problem:
        """Correlates the priors of two uncertain parameters (Gaussian copula), in (−1, 1)."""
        self._list("correlations").append(
            {"first": first, "second": second, "coefficient": coefficient})
        return self

    def derive(self, name: str, expression: str) -> Problem:
        """Ties a parameter to others by an expression, such as "2*k1"."""
        self._object("derived")[_text("name", name)] = expression
        return self

    def drive(self, name: str, signal: Signal) -> Problem:
        """Says how an input of the model runs over time."""
        self._list("inputs").append(
            {"name": name, **json_of("signal", signal, "a signal, such as polyest.Step(1.0)")})
        return self

    def stream(self, name: str, *, hold: bool = False,
               interpolation: Optional[Interpolation] = None) -> Problem:
        """Takes an input of the model from the measurements, in a column of its name.

        `interpolation` and `hold` say how it runs between its samples (see `Streamed`).
        """
        return self.drive(name, Streamed(hold=hold, interpolation=interpolation))

    def measure(self, output: str, noise: Union[float, Noise], *, column: str = "",
                unit: str = "") -> Problem:
        """Adds a measured output.

        `noise` is the standard deviation of its samples in the output's unit, or a `Noise`.
        `column` and `unit` name the column of the data that has it, and that column's unit.
        """
        sizes = noise if isinstance(noise, Noise) else Noise(absolute=number("noise", noise))
        self._list("measured").append(
            {"output": output, "noise": sizes.as_json()})
        return self.column(output, column, unit) if column or unit else self

    def column(self, quantity: str, header: str = "", unit: str = "") -> Problem:
        """Says which column of the data has a quantity (or `t`, or `run`), and in which unit."""
        entry = {key: value for key, value in (("from", header), ("unit", unit)) if value}
        self._object("columns")[_text("quantity", quantity)] = entry
        return self

    def use_when(self, condition: str) -> Problem:
        """Uses the samples of a row only where a condition holds, as in "v > 5 && !reverse"."""
        self._document["useWhen"] = condition
        return self

    def expand(self, *, order: Optional[int] = None, points_per_term: Optional[float] = None,
               points: Optional[Literal["HALTON", "HAMMERSLEY", "GAUSS_TENSOR"]] = None,
               adaptive: Optional[bool] = None,
               hyperbolic_exponent: Optional[float] = None,
               max_replay_row_count: Optional[int] = None) -> Problem:
        """Says how the outputs are expanded in polynomials; None leaves the daemon's default."""
        self._merge("expansion", order=order, pointsPerTerm=points_per_term, points=points,
                    adaptive=adaptive, hyperbolicExponent=hyperbolic_exponent,
                    maxReplayRowCount=max_replay_row_count)
        return self

    def integrate(self, *, method: Optional[Literal["AUTO", "EXPLICIT", "STIFF"]] = None,
                  relative_tolerance: Optional[float] = None,
                  max_steps: Optional[int] = None) -> Problem:
        """Says how trajectories are integrated; None leaves the daemon's default."""
        self._merge("integration", method=method, relativeTolerance=relative_tolerance,
                    maxSteps=max_steps)
        return self

    def regularize(self, weight: Union[float, Literal["L_CURVE", "DISCREPANCY", "EVIDENCE"]]
                   ) -> Problem:
        """Sets α², the weight of the prior's term (1 is Bayes' rule), or the rule for it."""
        if isinstance(weight, str):
            self._document["regularizationMode"] = weight
        else:
            self._document["regularization"] = number("weight", weight)
        return self

    def _merge(self, member: str, **values: Any) -> None:
        given = {name: value for name, value in values.items() if value is not None}
        self._object(member).update(given)

    def _object(self, name: str) -> dict[str, Any]:
        return self._member(name, {}, "an object, in braces { }")

    def _list(self, name: str) -> list[Any]:
        return self._member(name, [], "a list, in brackets [ ]")

    def _member(self, name: str, empty: Part, what: str) -> Part:
        """Returns a part of the document to add to. Raises WrongType if the document has another."""
        found = self._document.setdefault(name, empty)
        if found is None:
            found = self._document[name] = empty  # null stands for what is not given
        if not isinstance(found, type(empty)):
            raise wrong(name, found, what)
        return found

    def check(self, data: Optional[Data] = None, *, units: Optional[Mapping[str, str]] = None,
              client: Optional[Client] = None) -> Check:
        """Returns all errors and warnings of the problem, and of `data` up to the first error.

        The daemon checks it: `client`, or else a daemon on this machine (see `polyest.local`).
        """
        from polyest._default import default_client

        return (client or default_client()).check(self, data, units=units)

    def as_dict(self) -> dict[str, Any]:
        """Returns the JSON object of the problem file."""
        document: dict[str, Any] = _documents.copied(self._document)
        return document

    def as_json(self) -> str:
        """Returns the text of the problem file. Raises InvalidInput for what JSON does not have."""
        return _documents.text_of(self._document)

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes the problem file, which the command `polyest` also reads.

        Raises InvalidInput if it cannot be written.
        """
        name, text = path_of("path", path), self.as_json() + "\n"
        try:
            with open(name, "w", encoding="utf-8") as file:
                file.write(text)
        except OSError as error:
            raise file_error(name, "cannot be written", error) from error

    def copy(self) -> Problem:
        """Returns an independent copy."""
        return Problem(self._document)

    def __eq__(self, other: object) -> bool:
        """Whether two problems mean the same file."""
        if not isinstance(other, Problem):
            return False
        try:
            return to_message(self) == to_message(other)
        except InvalidInput:
            return self._document == other._document

    def __repr__(self) -> str:
        def named(member: str, name: str) -> str:
            entries = self._document.get(member)
            found = [str(entry.get(name)) for entry in entries if isinstance(entry, dict)
                     ] if isinstance(entries, list) else []
            return ", ".join(found) or "none"

        model = json.dumps(self._document.get("model", {}), default=repr)
        return (f"<polyest.Problem: {model[:60]}, uncertain {named('uncertain', 'name')}, "
                f"measured {named('measured', 'output')}>")


def _text(argument: str, value: Any) -> str:
    if not isinstance(value, str):
        raise wrong(argument, value, "a text")
    return value


def _points(argument: str, points: Any) -> dict[str, list[float]]:
    """Returns the places and values of a table. Raises WrongType."""
    if not isinstance(points, Sequence) or len(points) != 2:
        raise wrong(argument, points, "two lists: places, and the values there")
    places, values = (numbers(argument, one).tolist() for one in points)
    return {"x": places, "value": values}


#: A problem: built, as a problem file's JSON object, or the path of a problem file.
ProblemLike = Union[Problem, Mapping[str, Any], str, "os.PathLike[str]", problem_pb2.Problem]


def from_message(message: problem_pb2.Problem) -> Problem:
    """Returns the problem that a message holds."""
    return Problem(_documents.with_bounds(json_format.MessageToDict(message), message))


def to_message(problem: ProblemLike) -> problem_pb2.Problem:
    """Returns a problem as the daemon takes it. Raises InvalidInput for a field it lacks."""
    if isinstance(problem, problem_pb2.Problem):
        return problem
    place = ""
    if isinstance(problem, Problem):
        document = problem.as_dict()
    elif isinstance(problem, Mapping):
        document = _documents.copied(problem)
    else:
        document, place = _documents.read(problem), f"{os.fspath(problem)}: "
    expansion = document.get("expansion")
    if isinstance(expansion, dict) and expansion.get("order") == "AUTO":
        del expansion["order"]  # what the word means in a problem file
    message = problem_pb2.Problem()
    _parsing.parse(document, message, place)
    _documents.check_bounds(document, message, place)
    return message
