"""Draws of a problem's prior."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from statistics import NormalDist
from typing import Any, Union

import numpy as np

from polyest._parameters import without_run
from polyest._table import Floats

# Draws by which the quantiles of a prior of any kind are told.
_QUANTILE_DRAWS = 200_000
# Where the prior of a population's spread is cut off, in standard deviations of its logarithm.
_SPREAD_CUT = 5.0


def draws_of(names: Iterable[str], problem: Mapping[str, Any], count: int,
             seed: int) -> dict[str, Floats]:
    """Returns `count` draws from the prior of each parameter that an estimate names.

    Each run has draws of its own of "x_0[1]", and those of a population share its mean and spread.
    """
    generator = np.random.default_rng(seed)
    shared = prior_draws(problem, count, generator)
    walks = {f"processNoise.{one['state']}": one for one in problem.get("processNoise", [])}
    populations = {}
    for one in problem.get("uncertain", []):
        walks[f"{one['name']}.drift"] = one.get("drift", {}).get("randomWalk", {})
        if one.get("population"):
            populations[one["name"]] = _Population(one, count, generator)
    found: dict[str, Floats] = {}
    runs: dict[str, dict[str, Floats]] = {}
    for name in names:
        own = without_run(name)
        of_population = populations.get(own, populations.get(name.rpartition(".")[0]))
        if of_population is not None:
            found[name] = of_population.draw(name, generator)
        elif name in walks:
            lower, upper = (np.log(walks[name][end]) for end in ("lower", "upper"))
            found[name] = np.exp(generator.uniform(lower, upper, count))
        elif name in shared:
            found[name] = shared[name]
        else:
            run = name[len(own):]
            if run not in runs:
                runs[run] = prior_draws(problem, count, generator)
            found[name] = runs[run][own]
    return found


class _Population:
    """The runs' values of one parameter: their normal scores are N(μ, s²).

    A priori μ is N(0, 1), and log s is N(log ½, 1).
    """

    def __init__(self, entry: Mapping[str, Any], count: int,
                 generator: np.random.Generator) -> None:
        self._entry = entry
        self._middle = generator.standard_normal(count)
        self._spread = 0.5 * np.exp(_truncated_scores(-_SPREAD_CUT, _SPREAD_CUT, count, generator))
        self._drawn = _draw(entry, _QUANTILE_DRAWS, generator)

    def draw(self, name: str, generator: np.random.Generator) -> Floats:
        """Returns draws of "x_0.mean", "x_0.median", "x_0.spread" or "x_0[1]"."""
        if name.endswith(".spread"):
            return self._spread * self._unit_of_spread()
        if name.endswith((".mean", ".median")):
            return self._value(self._middle)
        return self._value(self._middle
                           + self._spread * generator.standard_normal(len(self._middle)))

    def _unit_of_spread(self) -> float:
        if "normal" in self._entry:
            return float(self._entry["normal"]["stdDev"])
        if "lognormal" in self._entry:
            return _logarithm(self._entry["lognormal"])[1]
        return 1.0

    def _value(self, score: Floats) -> Floats:
        """Returns the values that have these normal scores."""
        if "normal" in self._entry:
            said = self._entry["normal"]
            return said.get("mean", 0.0) + said["stdDev"] * score  # type: ignore[no-any-return]
        if "lognormal" in self._entry:
            middle, deviation = _logarithm(self._entry["lognormal"])
            return np.exp(middle + deviation * score)  # type: ignore[no-any-return]
        return np.quantile(self._drawn, [_probability(one) for one in score])


def prior_draws(problem: Mapping[str, Any], count: int,
                seed: Union[int, np.random.Generator]) -> dict[str, Floats]:
    """Returns `count` draws of each uncertain parameter of a problem's JSON object.

    Correlated ones are put in the order of correlated normal draws: each has its own distribution,
    and together they have the ranks of the Gaussian copula.
    """
    generator = np.random.default_rng(seed)
    uncertain = problem.get("uncertain", [])
    names = [one["name"] for one in uncertain]
    drawn = {one["name"]: _draw(one, count, generator) for one in uncertain}
    pairs = problem.get("correlations", [])
    if not pairs:
        return drawn
    correlation = np.eye(len(names))
    for pair in pairs:
        first, second = names.index(pair["first"]), names.index(pair["second"])
        correlation[first, second] = correlation[second, first] = pair.get("coefficient", 0.0)
    normal = generator.standard_normal((count, len(names))) @ np.linalg.cholesky(correlation).T
    for column, name in enumerate(names):
        ranks = np.argsort(np.argsort(normal[:, column]))
        drawn[name] = np.sort(drawn[name])[ranks]
    return drawn


def _draw(entry: Mapping[str, Any], count: int, generator: np.random.Generator) -> Floats:
    for kind, draw in _KINDS.items():
        if kind in entry:
            said = {name: float(value) for name, value in entry[kind].items()}
            values: Floats = draw(said, count, generator)
            return values
    raise ValueError(f"{entry.get('name')}: its prior is of no known kind")


def _uniform(said: dict[str, float], count: int, generator: np.random.Generator) -> Any:
    return generator.uniform(said.get("lower", 0.0), said.get("upper", 0.0), count)


def _normal(said: dict[str, float], count: int, generator: np.random.Generator) -> Any:
    return generator.normal(said.get("mean", 0.0), said["stdDev"], count)


def _beta(said: dict[str, float], count: int, generator: np.random.Generator) -> Any:
    lower, upper = said.get("lower", 0.0), said.get("upper", 0.0)
    return lower + (upper - lower) * generator.beta(said["alpha"], said["beta"], count)


def _gamma(said: dict[str, float], count: int, generator: np.random.Generator) -> Any:
    return said.get("shift", 0.0) + generator.gamma(said["shape"], said["scale"], count)


def _lognormal(said: dict[str, float], count: int, generator: np.random.Generator) -> Any:
    return generator.lognormal(*_logarithm(said), count)


def _logarithm(said: Mapping[str, float]) -> tuple[float, float]:
    """Returns mean and standard deviation of the logarithm of a lognormal quantity."""
    variance = np.log1p((said["stdDev"] / said["mean"]) ** 2)
    return float(np.log(said["mean"]) - variance / 2), float(np.sqrt(variance))


def _truncated_normal(said: dict[str, float], count: int, generator: np.random.Generator) -> Any:
    mean, deviation = said.get("mean", 0.0), said["stdDev"]
    lower, upper = ((said.get(name, end) - mean) / deviation
                    for name, end in (("lower", -np.inf), ("upper", np.inf)))
    return mean + deviation * _truncated_scores(lower, upper, count, generator)


def _truncated_scores(lower: float, upper: float, count: int,
                      generator: np.random.Generator) -> Floats:
    """Returns draws of N(0, 1) between two bounds."""
    if lower > 0:  # probabilities near 0 are exact, and near 1 they are not
        return -_truncated_scores(-upper, -lower, count, generator)
    uniform = generator.uniform(_probability(lower), _probability(upper), count)
    # The open interval: the quantiles of 0 and 1 are infinite.
    found = [NormalDist().inv_cdf(one) for one in np.clip(uniform, 1e-300, 1 - 1e-16)]
    return np.clip(found, lower, upper)


def _probability(score: float) -> float:
    """Returns the probability of N(0, 1) below a score, exact in the lower tail, too."""
    return 0.5 * math.erfc(-score / math.sqrt(2))


_KINDS = {"uniform": _uniform, "normal": _normal, "beta": _beta, "gamma": _gamma,
          "lognormal": _lognormal, "truncatedNormal": _truncated_normal}
