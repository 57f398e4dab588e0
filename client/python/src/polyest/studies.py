"""The studies of a session or of an experiment, which both offer them in the same way."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Optional, TypeVar

import numpy.typing as npt

from polyest import _calls, results
from polyest._calls import Call, Candidates, Subject
from polyest._measurements import MeasurementConverter
from polyest._proto.v1 import problem_pb2
from polyest._table import Data
from polyest.estimates import Estimate

Result = TypeVar("Result")


class Subjects(ABC):
    """What studies are about: a problem with measurements."""

    #: Units of columns by quantity, as given when the measurements were.
    _units: Mapping[str, str]

    @abstractmethod
    def _subject(self) -> Subject:
        """Returns the subject of the requests."""

    @abstractmethod
    def _problem(self) -> problem_pb2.Problem:
        """Returns the problem."""

    def _predict_call(self, record: Optional[Data], **options: Any) -> Call[results.Prediction]:
        converter = MeasurementConverter(self._problem(), self._units)
        other = None if record is None else converter.convert(record)
        return _calls.predict(self._subject(), record=other, **options)


class Studies(Subjects):
    """Questions about a session as it stands, or about an experiment.

    A count or step of 0 leaves the daemon's default. Every method raises a `PolyestError` if the
    daemon refuses the question: InvalidInput with the field and the rule, ResourceExhausted past a
    limit, FailedPrecondition if too few trajectories of the model succeed.
    """

    @abstractmethod
    def _run(self, call: Call[Result]) -> Result:
        """Makes a call."""

    @abstractmethod
    def estimate(self) -> Estimate:
        """Returns the estimate from all measurements."""

    @abstractmethod
    def history(self) -> results.History:
        """Returns how the estimate came about."""

    def predict(self, outputs: Sequence[str] = (), *, record: Optional[Data] = None,
                times: Optional[npt.ArrayLike] = None, run: int = 0,
                probabilities: Sequence[float] = (0.025, 0.5, 0.975), draws: int = 0,
                max_rows: int = 0, lags: int = 0, horizon_s: float = 0,
                smoothed: bool = False, forecast_s: float = 0,
                first_scored_row: int = 0) -> results.Prediction:
        """Returns the outputs over time as the posterior predicts them, and their scores.

        outputs: names of outputs and of parameters that drift; by default the measured outputs and
            what drifts.
        record: another record of the same problem, such as one held out, to predict and score.
        times: (T,), s, increasing, in run `run`; by default the record's rows, at most `max_rows`
            (2000).
        draws: trajectories of the model, 2 … 10000 (400). lags: of the autocorrelation (50).
        horizon_s: with process noise or drift, the length of windows within which no sample is
            used, s; 0: each row is predicted from all rows before it. `times` after the last row
            are forecasts.
        smoothed: with process noise or drift, each row is told from all rows of its run, those
            after it too: what drifting parameters have been. There are no scores then.
        forecast_s: if > 0, `max_rows` evenly spaced times up to so many seconds after the last row,
            in place of the record's rows; not where an input is streamed.
        first_scored_row: the rows before it, counted from 0, are not scored.
        """
        return self._run(self._predict_call(record, outputs=outputs, times=times, run=run,
                                            probabilities=probabilities, draws=draws,
                                            max_rows=max_rows, lags=lags,
                                            horizon_s=horizon_s, smoothed=smoothed,
                                            forecast_s=forecast_s,
                                            first_scored_row=first_scored_row))

    def posterior(self, *, probabilities: Sequence[float] = (), density_bins: int = 0,
                  joints: Sequence[tuple[str, str]] = (), all_joints: bool = False,
                  joint_bins: int = 0, samples: int = 0) -> results.Posterior:
        """Returns the posterior: densities, quantiles and `samples` draws (0 … 100000).

        joints: pairs of parameters whose joint density is wanted; `all_joints`: those of all pairs
        of the first 8. Default probabilities: 0.025, 0.5, 0.975; bins: 100 and 40.
        """
        return self._run(_calls.compute_posterior(
            self._subject(), probabilities=probabilities, density_bins=density_bins,
            joints=joints, all_joints=all_joints, joint_bins=joint_bins, samples=samples))

    def profiles(self, parameters: Sequence[str] = (), *, points: int = 0) -> results.CostProfiles:
        """Returns the cost over each parameter (all by default), minimized over the others.

        points: values of each parameter, 3 … 1001 (41).
        """
        return self._run(_calls.compute_profiles(self._subject(), parameters=parameters,
                                                 points=points))

    def cost_grid(self, parameters: Sequence[str] = (), *, points: int = 0,
                  held: Optional[Mapping[str, float]] = None) -> results.CostGrid:
        """Returns the cost over one or two parameters (the first two by default).

        points: of an axis (201 for one parameter, 41 for two). held: values of the others, in their
        units; by default their prior means.
        """
        return self._run(_calls.compute_cost_grid(self._subject(), parameters=parameters,
                                                  points=points, held=held or {}))

    def regularization(self, *, lowest: float = 0, highest: float = 0,
                       points: int = 0) -> results.RegularizationSweep:
        """Returns the estimates for weights α² of the prior, and what each rule chooses.

        lowest, highest: of α² (10⁻⁴, 10⁴); points: 2 … 1001 (33).
        """
        return self._run(_calls.compute_sweep(self._subject(), lowest=lowest, highest=highest,
                                              points=points))

    def propagate(self, until_s: float, step_s: float, *, outputs: Sequence[str] = (),
                  probabilities: Sequence[float] = (), density_bins: int = 0,
                  draws: int = 0) -> results.Propagation:
        """Returns what the prior predicts at 0, step_s, 2 step_s … until_s, in s.

        draws: of the prior, at which the model itself runs, 8 … 100000 (512); nearly all of the
            time is theirs.
        """
        return self._run(_calls.compute_propagation(
            self._subject(), until_s=until_s, step_s=step_s, outputs=outputs,
            probabilities=probabilities, density_bins=density_bins, draws=draws))

    def sensitivity(self, until_s: float, *, step_s: float = 0,
                    outputs: Sequence[str] = (), draws: int = 0) -> results.Sensitivity:
        """Returns which parameters the outputs depend on, and when (Sobol' indices).

        step_s: by default a hundredth of until_s. outputs: by default the measured ones.
        draws: of the prior, at which the expansion is compared with the model, 8 … 100000 (512).
        """
        return self._run(_calls.compute_sensitivity(self._subject(), until_s=until_s,
                                                    step_s=step_s, outputs=outputs,
                                                    draws=draws))

    def design(self, until_s: float, *, step_s: float = 0, samples: int = 0,
               candidates: Optional[Candidates] = None,
               outputs: Optional[Mapping[str, float]] = None) -> results.ExperimentDesign:
        """Returns what a next experiment would tell beyond what is known now.

        candidates: ways to drive the model, as in {"sweep": {"force": polyest.Chirp(…)}}; by
            default the problem's own inputs.
        outputs: outputs that could be measured besides, with the standard deviation of their noise
            in their unit; by default all others of the model.
        samples: sample times to choose, 0 … 1000 (10).
        """
        return self._run(_calls.compute_design(
            self._subject(), until_s=until_s, step_s=step_s, samples=samples,
            candidates=candidates or {}, outputs=outputs or {}))
