"""Parameters: prior and posterior, their history, marginal and joint densities."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from polyest._table import Floats
from polyest.plot import _figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from polyest.estimates import Estimate
    from polyest.results import History, Joint, Posterior


def estimate(result: Estimate) -> Figure:
    """Draws each parameter: ± 2 standard deviations of the prior, 95 % interval, value shown."""
    figure, axes = _figure.panels(len(result), height=0.9, share_x=False)
    for axis, one in zip(axes[:, 0], result):
        spread = 2 * one.prior_std_dev
        axis.barh(0, 2 * spread, left=one.prior_mean - spread, color=_figure.PRIOR, alpha=0.4,
                  height=0.8)
        axis.barh(0, one.upper95 - one.lower95, left=one.lower95, color=_figure.POSTERIOR,
                  height=0.5)
        axis.plot([one.shown[0]], [0], "|", color=_figure.MEASURED, markersize=12)
        axis.set_yticks([])
        axis.set_ylabel(one.name, rotation=0, ha="right", va="center")
        axis.set_xlabel(_figure.label(one.verdict.lower().replace("_", " "), one.unit))
    return figure


def history(result: History) -> Figure:
    """Draws each parameter's mean and 95 % interval over the time of the last sample."""
    last = result.points[-1].parameters if result.points else {}
    figure, axes = _figure.panels(max(len(last), 1))
    for axis, name in zip(axes[:, 0], last):
        points = [(point.sample_count, point.parameters[name]) for point in result.points
                  if name in point.parameters]
        samples = np.array([count for count, _ in points])
        axis.fill_between(samples, [one.lower95 for _, one in points],
                          [one.upper95 for _, one in points], color=_figure.BAND, alpha=0.5,
                          linewidth=0, label="95 % interval")
        axis.plot(samples, [one.mean for _, one in points], ".-", color=_figure.POSTERIOR,
                  linewidth=1, label="mean")
        axis.set_ylabel(_figure.label(name, last[name].unit))
    axes[-1, 0].set_xlabel("samples")
    axes[0, 0].legend(loc="best", fontsize="small")
    return figure


def corner(posterior: Posterior) -> Figure:
    """Draws marginal densities on the diagonal and the joint ones that there are below it.

    Contours of a joint density contain 39 %, 68 % and 95 % of its probability.
    """
    names = list(posterior.parameters)
    figure, axes = _figure.panels(len(names), len(names), height=2.0, width=2.2 * len(names),
                                  share_x="col")
    joints = {(one.first, one.second): one for one in posterior.joints}
    for row, below in enumerate(names):
        for column, left in enumerate(names):
            axis = axes[row, column]
            if row == column:
                one = posterior.parameters[below]
                axis.fill_between(one.value, one.density, color=_figure.BAND, alpha=0.5)
                axis.plot(one.value, one.density, color=_figure.POSTERIOR, linewidth=1)
                axis.set_yticks([])
            elif row > column and ((left, below) in joints or (below, left) in joints):
                _joint_panel(axis, joints, left, below)
            else:
                axis.set_axis_off()
    for index, name in enumerate(names):
        axes[-1, index].set_xlabel(_figure.label(name, posterior[name].unit))
        if index:
            axes[index, 0].set_ylabel(_figure.label(name, posterior[name].unit))
    return figure


def _joint_panel(axis: Any, joints: dict[tuple[str, str], Joint], left: str, below: str) -> None:
    turned = (left, below) not in joints
    one = joints[(below, left) if turned else (left, below)]
    across, up = ((one.second_value, one.first_value) if turned
                  else (one.first_value, one.second_value))
    density = one.density if turned else one.density.T
    levels = _levels(density, (0.95, 0.68, 0.39))
    if len(levels) > 0:
        axis.contourf(across, up, density, levels=[*levels, density.max() * 1.01], cmap="Blues",
                      extend="neither")


def _levels(density: Floats, shares: tuple[float, ...]) -> list[float]:
    """Returns the densities above which given shares of the probability lie, ascending."""
    falling = np.sort(density.ravel())[::-1]
    total = np.cumsum(falling)
    if total[-1] <= 0:
        return []
    found = [float(falling[min(np.searchsorted(total, share * total[-1]), len(falling) - 1)])
             for share in shares]
    return sorted({level for level in found if level < density.max()})
