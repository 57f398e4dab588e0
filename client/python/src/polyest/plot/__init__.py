"""Draws answers with matplotlib, which the extra `polyest[plot]` installs.

Each function takes a result and returns a matplotlib figure. The results' own methods `plot` call
them.
"""

from polyest.plot.cost import cost, profiles, regularization
from polyest.plot.parameters import corner, estimate, history
from polyest.plot.signals import fit, propagation, residuals, sensitivity

__all__ = ["corner", "cost", "estimate", "fit", "history", "profiles", "propagation",
           "regularization", "residuals", "sensitivity"]
