"""The outputs over time as the posterior predicts them, beside what was measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from polyest._messages import array
from polyest._proto.v1 import study_service_pb2
from polyest._table import Floats
from polyest.estimate_parts import Diagnostic

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Score:
    """The agreement of a prediction with all samples of one output."""

    #: Samples scored.
    sample_count: int
    #: Mean of log p(sample), p in 1/unit; the higher, the better.
    log_score: float
    #: Fraction of the samples within the central 95 % of the prediction, 0 … 1.
    coverage95: float
    #: Root mean square of the residuals, in the output's unit.
    root_mean_square: float
    #: (lags,), correlations of standardized residuals 1, 2, … samples apart in the same run.
    autocorrelation: Floats


@dataclass(frozen=True)
class AbruptChange:
    """A sudden change of a parameter that drifts, which its random walk does not explain."""

    #: The run.
    run: int
    #: s since the run began, at which the new value is there.
    time_s: float
    #: With the sign of the step; normal with standard deviation 1 if the parameter only walks.
    score: float
    #: What |score| of a walk exceeds in less than 1 % of records.
    limit: float


@dataclass(frozen=True)
class PredictedOutput:
    """One output over T times, with P quantiles and M samples; values are in `unit`."""

    #: The output's name.
    output: str
    #: Its unit; "1" for a pure number, empty where the equations give none.
    unit: str
    #: (T,), the prediction's mean.
    mean: Floats
    #: (T,), the prediction's standard deviation.
    std_dev: Floats
    #: (T, P), quantiles of the prediction.
    quantiles: Floats
    #: (T,), standard deviation of a new sample, which has the noise; None if that is not known.
    sample_std_dev: Optional[Floats]
    #: (T, P), quantiles of a new sample; None likewise.
    sample_quantiles: Optional[Floats]
    #: (M,), the times that have a sample, counted from 0.
    measured_rows: npt.NDArray[np.int64]
    #: (M,), the samples.
    measured: Floats
    #: (M,), sample − mean.
    residual: Floats
    #: (M,), residual ÷ sample_std_dev, pure numbers; None if that is not known.
    standardized_residual: Optional[Floats]
    #: How well the samples of the whole record agree; None if the noise is not known.
    score: Optional[Score]
    #: The sudden change that the random walk of a drifting parameter explains least; None if the
    #: walk explains all changes, or if the prediction is not smoothed.
    abrupt_change: Optional[AbruptChange] = None


@dataclass(frozen=True)
class Prediction:
    """The outputs over T times as the posterior predicts them; `prediction["x"]` is one of them."""

    #: (T,), s since the run began.
    time_s: Floats
    #: (T,), the run of each time.
    run: npt.NDArray[np.int64]
    #: (P,), the probabilities of the quantiles.
    probabilities: Floats
    #: The outputs by name.
    outputs: dict[str, PredictedOutput]
    #: Trajectories at draws of the posterior.
    draw_count: int
    #: How many of them could not be integrated to the end.
    failed_draw_count: int
    #: Rows of the record that was predicted.
    row_count: int
    #: Warnings, as of an estimate.
    diagnostics: list[Diagnostic]
    #: The session's last batch taken into account; 0 without one.
    sequence: int

    def __getitem__(self, output: str) -> PredictedOutput:
        """Returns one output. Raises KeyError."""
        return self.outputs[output]

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.outputs)

    def to_dataframe(self, output: str) -> pandas.DataFrame:
        """Returns one output with a row for each time; NaN where none is measured."""
        import pandas as pd

        one = self.outputs[output]
        columns: dict[str, Any] = {"run": self.run, "mean": one.mean, "std_dev": one.std_dev}
        columns.update({f"q{probability:g}": one.quantiles[:, column]
                        for column, probability in enumerate(self.probabilities)})
        if one.sample_std_dev is not None:
            columns["sample_std_dev"] = one.sample_std_dev
        for name, values in (("measured", one.measured), ("residual", one.residual)):
            columns[name] = np.full(len(self.time_s), np.nan)
            columns[name][one.measured_rows] = values
        return pd.DataFrame(columns, index=pd.Index(self.time_s, name="t"))

    def plot(self) -> Figure:
        """Draws samples, means and 95 % bands. Returns a matplotlib figure."""
        from polyest import plot

        return plot.fit(self)


def _output_of(message: Any, times: int, probabilities: int) -> PredictedOutput:
    noisy = len(message.sample_std_dev) > 0
    score = None
    if message.HasField("score"):
        said = message.score
        score = Score(said.sample_count, said.log_score, said.coverage95, said.root_mean_square,
                      array(said.autocorrelation))
    change = None
    if message.HasField("abrupt_change"):
        told = message.abrupt_change
        change = AbruptChange(told.run, told.time_s, told.score, told.limit)
    return PredictedOutput(
        output=message.output, unit=message.unit, mean=array(message.mean),
        std_dev=array(message.std_dev), quantiles=array(message.quantiles, times, probabilities),
        sample_std_dev=array(message.sample_std_dev) if noisy else None,
        sample_quantiles=array(message.sample_quantiles, times, probabilities) if noisy else None,
        measured_rows=np.array(message.measured_rows, dtype=np.int64),
        measured=array(message.measured), residual=array(message.residual),
        standardized_residual=(array(message.standardized_residual)
                               if message.standardized_residual else None), score=score,
        abrupt_change=change)


def of_message(message: study_service_pb2.PredictResponse) -> Prediction:
    """Returns a prediction as the daemon has sent it."""
    times, probabilities = len(message.time_s), len(message.probabilities)
    return Prediction(
        time_s=array(message.time_s),
        run=np.array(message.run, dtype=np.int64) if message.run else np.zeros(times, np.int64),
        probabilities=array(message.probabilities),
        outputs={one.output: _output_of(one, times, probabilities) for one in message.outputs},
        draw_count=message.draw_count, failed_draw_count=message.failed_draw_count,
        row_count=message.row_count,
        diagnostics=[Diagnostic.of_message(one) for one in message.diagnostics],
        sequence=message.sequence)
