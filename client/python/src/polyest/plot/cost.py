"""The cost: contours, profiles, the L-curve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from polyest._table import refuse
from polyest.plot import _figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from polyest.results import CostGrid, CostProfiles, RegularizationSweep

# Where a χ² of one degree of freedom has its quantile of 95 %, halved: the cost is −log density.
_COST_OF_95 = 1.92


def cost(grid: CostGrid) -> Figure:
    """Draws the total cost above its least value: a curve, or contours even in its logarithm.

    Raises InvalidInput if the cost is finite nowhere on the grid.
    """
    finite = np.isfinite(grid.total)
    if not finite.any():
        raise refuse("grid", "its cost is finite nowhere: the model fails, or the prior's density "
                     "is 0, at all of its points")
    figure, axes = _figure.panels(1, height=4.0, width=6.0)
    axis = axes[0, 0]
    excess = grid.total - grid.total[finite].min()
    first = grid.axes[0]
    axis.set_xlabel(_figure.label(first.parameter, first.unit))
    if len(grid.axes) == 1:
        axis.plot(first.value, excess, color=_figure.POSTERIOR)
        axis.set_ylabel("cost above its minimum")
        return figure
    second = grid.axes[1]
    axis.set_ylabel(_figure.label(second.parameter, second.unit))
    excess[~finite] = np.nan  # not drawn
    drawn = axis.contourf(first.value, second.value, np.log10(1 + excess).T, levels=20,
                          cmap="viridis")
    figure.colorbar(drawn, label="log₁₀(1 + cost above its minimum)")
    row, column = np.unravel_index(np.nanargmin(excess), excess.shape)
    axis.plot(first.value[row], second.value[column], "+", color="white", markersize=10)
    return figure


def profiles(result: CostProfiles) -> Figure:
    """Draws each parameter's profile above the least cost; the line is where 95 % end."""
    figure, axes = _figure.panels(1, len(result.profiles), height=2.6, share_x=False)
    for axis, one in zip(axes[0], result.profiles.values()):
        axis.plot(one.value, one.total - result.least.total, color=_figure.POSTERIOR)
        failed = ~one.converged
        axis.plot(one.value[failed], (one.total - result.least.total)[failed], "x",
                  color=_figure.MEASURED)
        axis.axhline(_COST_OF_95, color=_figure.PRIOR, linewidth=0.8, linestyle="--")
        axis.set_xlabel(_figure.label(one.parameter, one.unit))
    axes[0, 0].set_ylabel("cost above its minimum")
    return figure


def regularization(sweep: RegularizationSweep) -> Figure:
    """Draws the L-curve: the prior's term over the mismatch, and what each rule chooses."""
    figure, axes = _figure.panels(1, height=3.5, width=6.0)
    axis = axes[0, 0]
    mismatch = np.array([point.cost.mismatch for point in sweep.points])
    prior = np.array([point.cost.prior for point in sweep.points])
    axis.plot(mismatch, prior, ".-", color=_figure.POSTERIOR)
    weights = np.log([point.regularization for point in sweep.points])
    for marker, (rule, choice) in zip("os^", sweep.choices.items()):
        if choice.determined and len(weights):
            at = np.log(choice.regularization)
            axis.plot(np.interp(at, weights, mismatch), np.interp(at, weights, prior), marker,
                      fillstyle="none", label=f"{rule}: α² = {choice.regularization:.3g}")
    axis.set_xlabel("mismatch")
    axis.set_ylabel("prior's term")
    if axis.get_legend_handles_labels()[0]:
        axis.legend(fontsize="small")
    return figure
