"""Draws of a problem's prior."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import NormalDist
from typing import Any

import numpy as np

from polyest._table import Floats


def prior_draws(problem: Mapping[str, Any], count: int, seed: int) -> dict[str, Floats]:
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
    variance = np.log1p((said["stdDev"] / said["mean"]) ** 2)
    return generator.lognormal(np.log(said["mean"]) - variance / 2, np.sqrt(variance), count)


def _truncated_normal(said: dict[str, float], count: int, generator: np.random.Generator) -> Any:
    normal = NormalDist(said.get("mean", 0.0), said["stdDev"])
    lower = normal.cdf(said["lower"]) if "lower" in said else 0.0
    upper = normal.cdf(said["upper"]) if "upper" in said else 1.0
    # The open interval: the quantiles of 0 and 1 are infinite.
    uniform = np.clip(generator.uniform(lower, upper, count), 1e-300, 1 - 1e-16)
    return np.array([normal.inv_cdf(one) for one in uniform])


_KINDS = {"uniform": _uniform, "normal": _normal, "beta": _beta, "gamma": _gamma,
          "lognormal": _lognormal, "truncatedNormal": _truncated_normal}
