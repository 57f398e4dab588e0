"""Results as xarray groups for ArviZ.

The groups are those of ArviZ's schema as far as the daemon's answers go: `posterior`, `prior`,
`observed_data`, and `prediction`, the moments and quantiles of the outputs. Where the samples of a
posterior come from Markov chains, their four groups are the chains, of which ArviZ computes R̂; in
importance sampling there is one chain, and no R̂. The daemon's own R̂ (NaN for importance sampling)
and effective sample sizes, of all of its draws, are attributes of `posterior` and of its variables.
It returns no outputs at single draws: if they are asked for, each draw takes a call, which gives
`log_likelihood` and `posterior_predictive`.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from google.protobuf import json_format

from polyest._at_draws import MOST_ROWS, outputs_at_draws
from polyest._draws import draws_of
from polyest._table import Integers, refuse
from polyest.results import Posterior, Prediction

if TYPE_CHECKING:
    from polyest.studies import Studies


def of_studies(studies: Studies, *, samples: int = 1000, seed: int = 0,
               predictive: bool = False) -> Any:
    """Returns an xarray.DataTree of a session or experiment.

    samples: of the posterior and of the prior. seed: of the prior's, which are drawn here, and of
    new samples' noise. predictive: adds `posterior_predictive`, new samples at each draw, and
    `log_likelihood`, in 1/unit, of the samples measured; of an experiment only, at the cost of a
    call of the daemon for each draw, and where noise is known and white (InvalidInput elsewhere);
    all rows of the record are then there, 1,000,000 at most. Without it, a longer record than 2,000
    rows has so many evenly spaced ones, with a warning.
    Raises ImportError if xarray is not there, or older than 2024.10, which brought DataTree.
    """
    import xarray

    if not hasattr(xarray, "DataTree"):
        raise ImportError("a DataTree needs xarray 2024.10 or later; polyest.datatree.groups "
                          "returns its groups as a dict of xarray.Dataset")
    return xarray.DataTree.from_dict(groups(studies, samples=samples, seed=seed,
                                            predictive=predictive))


def groups(studies: Studies, *, samples: int = 1000, seed: int = 0,
           predictive: bool = False) -> dict[str, Any]:
    """Returns the groups as xarray.Dataset by name; arguments as of `of_studies`."""
    problem = json_format.MessageToDict(studies._problem())
    prediction = _predicted(studies, predictive)
    posterior = studies.posterior(samples=samples)
    prior = draws_of(posterior.parameters, problem, samples, seed)
    found = {"posterior": _posterior(posterior),
             "prior": _draws(prior, np.array([], dtype=np.int64)),
             "observed_data": _observed(prediction), "prediction": _prediction(prediction)}
    if predictive:
        found.update(_predictive(studies, posterior, prediction, seed))
    return found


def _predicted(studies: Studies, all_rows: bool) -> Prediction:
    """Returns the prediction of the record. Raises InvalidInput if `all_rows` are too many."""
    prediction = studies.predict(max_rows=MOST_ROWS if all_rows else 0)
    shown = len(prediction.time_s)
    if shown < prediction.row_count:
        if all_rows:
            raise refuse("predictive", f"the record has {prediction.row_count} rows; there may be "
                         f"{MOST_ROWS}")
        warnings.warn(f"observed_data and prediction have {shown} of {prediction.row_count} rows, "
                      "evenly spaced", stacklevel=4)
    return prediction


def _predictive(studies: Studies, posterior: Posterior, prediction: Prediction,
                seed: int) -> dict[str, Any]:
    """Returns new samples at each draw, and the log density of those measured."""
    import xarray

    from polyest.client import Experiment

    if not isinstance(studies, Experiment):
        raise refuse("predictive", "is there for experiments; see Client.experiment")
    generator = np.random.default_rng(seed)
    new: dict[str, Any] = {}
    likely: dict[str, Any] = {}
    for name, at in outputs_at_draws(studies, posterior).items():
        one = prediction.outputs[name]
        units = {"units": one.unit}
        new[name] = (("chain", "draw", "row"),
                     _by_chain(generator.normal(at.mean, at.noise), posterior.sample_chains),
                     units)
        rows = one.measured_rows
        whole = len(rows) == len(prediction.time_s)
        off = (one.measured - at.mean[:, rows]) / at.noise[:, rows]
        density = -0.5 * off**2 - np.log(at.noise[:, rows]) - 0.5 * np.log(2 * np.pi)
        likely[name] = (("chain", "draw", "row" if whole else f"row_{name}"),
                        _by_chain(density, posterior.sample_chains), units)
    return {"posterior_predictive": xarray.Dataset(new, coords=_row_coordinates(prediction)),
            "log_likelihood": xarray.Dataset(likely)}


def _by_chain(values: Any, chains: Integers) -> Any:
    """Returns (draws, …) as (chains, draws, …), as many of each chain as the shortest one has."""
    values = np.asarray(values)
    if len(chains) == 0:
        return values[np.newaxis]
    apart = [values[chains == chain] for chain in range(chains[-1] + 1)]
    least = min(len(one) for one in apart)
    return np.stack([one[:least] for one in apart])


def _draws(values: dict[str, Any], chains: Integers) -> Any:
    import xarray

    return xarray.Dataset({name: (("chain", "draw"), _by_chain(drawn, chains))
                           for name, drawn in values.items()})


def _posterior(posterior: Posterior) -> Any:
    found = _draws({name: posterior.samples[:, column]
                    for column, name in enumerate(posterior.parameters)},
                   posterior.sample_chains)
    convergence = posterior.convergence()
    for name, one in convergence.parameters.items():
        found[name].attrs.update(units=posterior[name].unit, r_hat=one.r_hat,
                                 effective_sample_size=one.effective_sample_size)
    found.attrs.update(method=posterior.method, draw_count=posterior.draw_count,
                       r_hat=np.max([one.r_hat for one in convergence.parameters.values()]),
                       inference_library="polyest")
    return found


def _row_coordinates(prediction: Prediction) -> dict[str, Any]:
    return {"time": ("row", prediction.time_s, {"units": "s"}), "run": ("row", prediction.run)}


def _observed(prediction: Prediction) -> Any:
    import xarray

    variables: dict[str, Any] = {}
    for name, one in prediction.outputs.items():
        values = np.full(len(prediction.time_s), np.nan)
        values[one.measured_rows] = one.measured
        variables[name] = ("row", values, {"units": one.unit})
    return xarray.Dataset(variables, coords=_row_coordinates(prediction))


def _prediction(prediction: Prediction) -> Any:
    import xarray

    variables: dict[str, Any] = {}
    for name, one in prediction.outputs.items():
        units = {"units": one.unit}
        variables[f"{name}_mean"] = ("row", one.mean, units)
        variables[f"{name}_std_dev"] = ("row", one.std_dev, units)
        variables[f"{name}_quantiles"] = (("row", "probability"), one.quantiles, units)
        if one.sample_quantiles is not None:
            variables[f"{name}_sample_std_dev"] = ("row", one.sample_std_dev, units)
            variables[f"{name}_sample_quantiles"] = (("row", "probability"), one.sample_quantiles,
                                                     units)
    return xarray.Dataset(variables, coords={**_row_coordinates(prediction),
                                             "probability": prediction.probabilities})
