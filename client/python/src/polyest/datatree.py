"""Results as xarray groups for ArviZ.

The groups are those of ArviZ's schema as far as the daemon's answers go: `posterior`, `prior`,
`observed_data`, and `prediction`, the moments and quantiles of the outputs. The daemon returns the
samples of a posterior as one sequence of equal weight, so that there is one chain; its own R̂ and
effective sample sizes are attributes of `posterior`. It returns no outputs at single draws, so that
there is neither `log_likelihood` nor `posterior_predictive`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from google.protobuf import json_format

from polyest._draws import prior_draws
from polyest.results import Posterior, Prediction

if TYPE_CHECKING:
    from polyest.studies import Studies


def of_studies(studies: Studies, *, samples: int = 1000, seed: int = 0) -> Any:
    """Returns an xarray.DataTree of a session or experiment.

    samples: of the posterior and of the prior. seed: of the prior's, which are drawn here.
    Raises ImportError if xarray is not there, or older than 2024.10, which brought DataTree.
    """
    import xarray

    if not hasattr(xarray, "DataTree"):
        raise ImportError("a DataTree needs xarray 2024.10 or later; polyest.datatree.groups "
                          "returns its groups as a dict of xarray.Dataset")
    return xarray.DataTree.from_dict(groups(studies, samples=samples, seed=seed))


def groups(studies: Studies, *, samples: int = 1000, seed: int = 0) -> dict[str, Any]:
    """Returns the groups as xarray.Dataset by name; arguments as of `of_studies`."""
    problem = json_format.MessageToDict(studies._problem())
    prediction = studies.predict()
    return {"posterior": _posterior(studies.posterior(samples=samples)),
            "prior": _draws(prior_draws(problem, samples, seed)),
            "observed_data": _observed(prediction), "prediction": _prediction(prediction)}


def _draws(values: dict[str, Any]) -> Any:
    import xarray

    return xarray.Dataset({name: (("chain", "draw"), np.asarray(drawn)[np.newaxis])
                           for name, drawn in values.items()})


def _posterior(posterior: Posterior) -> Any:
    found = _draws({name: posterior.samples[:, column]
                    for column, name in enumerate(posterior.parameters)})
    for name, one in posterior.parameters.items():
        found[name].attrs.update(units=one.unit, r_hat=one.r_hat,
                                 effective_sample_size=one.effective_sample_size)
    found.attrs.update(method=posterior.method, draw_count=posterior.draw_count,
                       r_hat=posterior.r_hat, inference_library="polyest")
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
