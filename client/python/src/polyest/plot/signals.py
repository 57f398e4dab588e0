"""Signals over time: the fit, its residuals, the prior's predictions, sensitivities."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from polyest.plot import _figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from polyest.results import PredictedOutput, Prediction, Propagation, Sensitivity


def fit(prediction: Prediction) -> Figure:
    """Draws the samples, the prediction's mean, and the bands of prediction and new samples.

    A row for each output, a column for each of the first four runs.
    """
    runs = _figure.runs_of(prediction.run)
    figure, axes = _figure.panels(len(prediction.outputs), max(len(runs), 1))
    for row, one in enumerate(prediction.outputs.values()):
        for column, run in enumerate(runs):
            _fit_panel(axes[row, column], prediction, one, run)
        axes[row, 0].set_ylabel(_figure.label(one.output, one.unit))
    for column, run in enumerate(runs):
        axes[-1, column].set_xlabel("t [s]" if len(runs) == 1 else f"t of run {run} [s]")
    axes[0, 0].legend(loc="best", fontsize="small")
    return figure


def _fit_panel(axis: Any, prediction: Prediction, one: PredictedOutput, run: int) -> None:
    of_run = prediction.run == run
    times = prediction.time_s[of_run]
    ends = _figure.outer(prediction.probabilities)
    if ends is not None:
        lower, upper = ends
        if one.sample_quantiles is not None:
            axis.fill_between(
                times, one.sample_quantiles[of_run, lower], one.sample_quantiles[of_run, upper],
                color=_figure.BAND, alpha=0.3, linewidth=0,
                label=_figure.band_name(prediction.probabilities, "new samples"))
        axis.fill_between(times, one.quantiles[of_run, lower], one.quantiles[of_run, upper],
                          color=_figure.POSTERIOR, alpha=0.5, linewidth=0,
                          label=_figure.band_name(prediction.probabilities, "the prediction"))
    axis.plot(times, one.mean[of_run], color=_figure.POSTERIOR, linewidth=1, label="mean")
    measured = of_run[one.measured_rows]
    axis.plot(prediction.time_s[one.measured_rows][measured], one.measured[measured], ".",
              color=_figure.MEASURED, markersize=2, label="measured")


def residuals(prediction: Prediction) -> Figure:
    """Draws residuals in standard deviations of a sample, and their autocorrelation.

    If the model is right, 95 % of them lie within ±2, and correlations within ±2/√samples.
    Residuals of an output whose noise is not known are in its unit, without autocorrelation.
    """
    figure, axes = _figure.panels(len(prediction.outputs), 2, share_x=False)
    for row, one in enumerate(prediction.outputs.values()):
        left, right = axes[row]
        values = one.residual if one.standardized_residual is None else one.standardized_residual
        left.plot(prediction.time_s[one.measured_rows], values, ".", color=_figure.MEASURED,
                  markersize=2)
        left.axhline(0, color=_figure.PRIOR, linewidth=0.8)
        left.set_xlabel("t [s]")
        left.set_ylabel(_figure.label(f"residual of {one.output}", one.unit)
                        if one.standardized_residual is None else f"residual of {one.output} / sd")
        if one.standardized_residual is not None:
            left.axhspan(-2, 2, color=_figure.BAND, alpha=0.2, linewidth=0)
        if one.score is None:
            right.set_axis_off()
            continue
        lags = np.arange(1, len(one.score.autocorrelation) + 1)
        right.vlines(lags, 0, one.score.autocorrelation, color=_figure.POSTERIOR)
        chance = 2 / np.sqrt(max(one.score.sample_count, 1))
        right.axhspan(-chance, chance, color=_figure.BAND, alpha=0.2, linewidth=0)
        right.set_xlabel("lag [samples]")
        right.set_ylabel("autocorrelation")
    return figure


def propagation(result: Propagation) -> Figure:
    """Draws the prior's mean and the band between the outermost quantiles of each output."""
    figure, axes = _figure.panels(len(result.outputs))
    ends = _figure.outer(result.probabilities)
    for row, one in enumerate(result.outputs.values()):
        axis = axes[row, 0]
        if ends is not None:
            axis.fill_between(result.time_s, one.quantiles[:, ends[0]], one.quantiles[:, ends[1]],
                              color=_figure.PRIOR, alpha=0.4, linewidth=0,
                              label=_figure.band_name(result.probabilities, "the prior"))
        axis.plot(result.time_s, one.mean, color=_figure.MEASURED, linewidth=1, label="mean")
        axis.set_ylabel(_figure.label(one.name, one.unit))
    axes[-1, 0].set_xlabel("t [s]")
    axes[0, 0].legend(loc="best", fontsize="small")
    return figure


def sensitivity(result: Sensitivity) -> Figure:
    """Draws the share of each output's variance that involves each parameter, over time."""
    figure, axes = _figure.panels(len(result.outputs))
    for row, one in enumerate(result.outputs.values()):
        for column, name in enumerate(result.parameters):
            axes[row, 0].plot(result.time_s, one.total[:, column], label=name)
        axes[row, 0].set_ylabel(f"share of {one.name}")
        axes[row, 0].set_ylim(-0.02, 1.02)
    axes[-1, 0].set_xlabel("t [s]")
    axes[0, 0].legend(loc="best", fontsize="small")
    return figure
