"""Figures and what their parts share: colours, labels, bands."""

from __future__ import annotations

from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from polyest._table import Floats

#: Colours that readers who do not see red or green tell apart (Okabe and Ito).
PRIOR, POSTERIOR, MEASURED, BAND = "#999999", "#0072b2", "#222222", "#56b4e9"


def panels(rows: int, columns: int = 1, *, height: float = 2.2, width: float = 7.0,
           share_x: Any = True) -> tuple[Any, Any]:
    """Returns a figure and its (rows, columns) axes; sizes of a panel in inches."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(rows, columns, squeeze=False, sharex=share_x,
                                figsize=(max(width, 3.0 * columns), 0.8 + height * rows),
                                constrained_layout=True)
    return figure, axes


def label(name: str, unit: str) -> str:
    """Returns a label of an axis: the name and its unit."""
    return name if unit in ("", "1") else f"{name} [{unit}]"


def outer(probabilities: Floats) -> Optional[tuple[int, int]]:
    """Returns the columns of the outermost quantiles; None if there are not two."""
    if len(probabilities) < 2:
        return None
    return int(np.argmin(probabilities)), int(np.argmax(probabilities))


def band_name(probabilities: Floats, what: str) -> str:
    """Returns the legend of a band between the outermost quantiles."""
    return f"{100 * (probabilities.max() - probabilities.min()):.3g} % of {what}"


def runs_of(run: npt.NDArray[np.int64], most: int = 4) -> list[int]:
    """Returns the first runs, each of which has a column of its own."""
    return [int(one) for one in np.unique(run)[:most]]
