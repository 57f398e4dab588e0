"""The studies of a session or of an experiment, for asyncio; see `polyest.studies`."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Optional, TypeVar

import numpy.typing as npt

from polyest import _calls, results
from polyest._calls import Call, Candidates
from polyest._table import Data
from polyest.estimates import Estimate
from polyest.studies import Subjects

Result = TypeVar("Result")


class Studies(Subjects):
    """Questions about a session or an experiment; arguments and errors as in `polyest.Session`."""

    @abstractmethod
    async def _run(self, call: Call[Result]) -> Result:
        """Makes a call."""

    @abstractmethod
    async def estimate(self) -> Estimate:
        """Returns the estimate from all measurements."""

    @abstractmethod
    async def history(self) -> results.History:
        """Returns how the estimate came about."""

    async def predict(self, outputs: Sequence[str] = (), *, record: Optional[Data] = None,
                      times: Optional[npt.ArrayLike] = None, run: int = 0,
                      probabilities: Sequence[float] = (0.025, 0.5, 0.975), draws: int = 0,
                      max_rows: int = 0, lags: int = 0,
                      horizon_s: float = 0, smoothed: bool = False,
                      forecast_s: float = 0,
                      first_scored_row: int = 0) -> results.Prediction:
        """Returns the outputs over time as the posterior predicts them, and their scores."""
        return await self._run(self._predict_call(
            record, outputs=outputs, times=times, run=run, probabilities=probabilities,
            draws=draws, max_rows=max_rows, lags=lags, horizon_s=horizon_s,
            smoothed=smoothed, forecast_s=forecast_s, first_scored_row=first_scored_row))

    async def posterior(self, *, probabilities: Sequence[float] = (), density_bins: int = 0,
                        joints: Sequence[tuple[str, str]] = (), all_joints: bool = False,
                        joint_bins: int = 0, samples: int = 0) -> results.Posterior:
        """Returns the posterior: densities, quantiles and samples."""
        return await self._run(_calls.compute_posterior(
            self._subject(), probabilities=probabilities, density_bins=density_bins,
            joints=joints, all_joints=all_joints, joint_bins=joint_bins, samples=samples))

    async def profiles(self, parameters: Sequence[str] = (), *,
                       points: int = 0) -> results.CostProfiles:
        """Returns the cost over each parameter, minimized over the others."""
        return await self._run(_calls.compute_profiles(self._subject(), parameters=parameters,
                                                       points=points))

    async def cost_grid(self, parameters: Sequence[str] = (), *, points: int = 0,
                        held: Optional[Mapping[str, float]] = None) -> results.CostGrid:
        """Returns the cost over one or two parameters."""
        return await self._run(_calls.compute_cost_grid(
            self._subject(), parameters=parameters, points=points, held=held or {}))

    async def regularization(self, *, lowest: float = 0, highest: float = 0,
                             points: int = 0) -> results.RegularizationSweep:
        """Returns the estimates for weights of the prior, and what each rule chooses."""
        return await self._run(_calls.compute_sweep(self._subject(), lowest=lowest,
                                                    highest=highest, points=points))

    async def propagate(self, until_s: float, step_s: float, *, outputs: Sequence[str] = (),
                        probabilities: Sequence[float] = (), density_bins: int = 0,
                        draws: int = 0) -> results.Propagation:
        """Returns what the prior predicts at 0, step_s, 2 step_s … until_s, in s."""
        return await self._run(_calls.compute_propagation(
            self._subject(), until_s=until_s, step_s=step_s, outputs=outputs,
            probabilities=probabilities, density_bins=density_bins, draws=draws))

    async def sensitivity(self, until_s: float, *, step_s: float = 0,
                          outputs: Sequence[str] = (), draws: int = 0
                          ) -> results.Sensitivity:
        """Returns which parameters the outputs depend on, and when (Sobol' indices)."""
        return await self._run(_calls.compute_sensitivity(self._subject(), until_s=until_s,
                                                          step_s=step_s, outputs=outputs,
                                                          draws=draws))

    async def design(self, until_s: float, *, step_s: float = 0, samples: int = 0,
                     candidates: Optional[Candidates] = None,
                     outputs: Optional[Mapping[str, float]] = None) -> results.ExperimentDesign:
        """Returns what a next experiment would tell beyond what is known now."""
        return await self._run(_calls.compute_design(
            self._subject(), until_s=until_s, step_s=step_s, samples=samples,
            candidates=candidates or {}, outputs=outputs or {}))
