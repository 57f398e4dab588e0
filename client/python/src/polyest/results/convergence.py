"""Whether the draws of a posterior suffice: R̂ and effective sample size of each parameter.

The daemon computes both from all of its draws, by the ranks of the draws as in A. Vehtari et al.,
"Rank-normalization, folding, and localization: an improved R̂ for assessing convergence of MCMC",
Bayesian Analysis 16 (2021). It runs four groups of Markov chains that never exchange anything, and
R̂ compares the first and second halves of the groups: 8 sequences. It is the R̂ of the ranks; that of
ArviZ is the larger one of it and of a second, folded one. A posterior in several separate pieces
has the largest R̂ of its pieces.

The samples that the daemon returns are a thinned selection of these draws, equally many from each of
the four groups. `Posterior.sample_chains` says which group each one is of.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from polyest import _html

if TYPE_CHECKING:
    import pandas

    from polyest.results.posterior import Posterior

#: The largest R̂ of chains that have mixed.
MAX_R_HAT = 1.01
#: The least effective sample size of draws that suffice.
MIN_EFFECTIVE_SAMPLE_SIZE = 400.0

_HEADER = ("parameter", "R̂", "effective samples", "verdict")


@dataclass(frozen=True)
class ParameterConvergence:
    """How well the draws tell one parameter; pure numbers."""

    #: The parameter's name.
    name: str
    #: Rank-normalized split R̂; NaN for importance sampling, whose draws form no chains.
    r_hat: float
    #: Number of independent draws that would tell as much, at most the number of draws.
    effective_sample_size: float

    @property
    def converged(self) -> bool:
        """Whether R̂, where there is one, and effective sample size are within their limits."""
        return not self.r_hat > MAX_R_HAT and (
            self.effective_sample_size >= MIN_EFFECTIVE_SAMPLE_SIZE)

    def _row(self) -> tuple[str, str, str, str]:
        r_hat = "–" if math.isnan(self.r_hat) else f"{self.r_hat:.4f}"
        return (self.name, r_hat, f"{self.effective_sample_size:.0f}",
                "suffices" if self.converged else "does not suffice")


@dataclass(frozen=True, repr=False)
class Convergence:
    """Convergence of n parameters; `convergence["k"]` is that of one. Shown as a table."""

    #: One entry for each parameter, by name, in the problem's order.
    parameters: dict[str, ParameterConvergence]
    #: "IMPORTANCE_SAMPLING" or "MARKOV_CHAINS".
    method: str
    #: Number of draws that the daemon has made.
    draw_count: int

    def __getitem__(self, name: str) -> ParameterConvergence:
        """Returns the convergence of a parameter. Raises KeyError."""
        return self.parameters[name]

    @property
    def converged(self) -> bool:
        """Whether the draws suffice for every parameter: R̂ ≤ 1.01, 400 effective samples."""
        return all(one.converged for one in self.parameters.values())

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns a DataFrame with a row for each parameter."""
        import pandas as pd

        return pd.DataFrame(
            [(one.r_hat, one.effective_sample_size, one.converged)
             for one in self.parameters.values()],
            index=pd.Index(list(self.parameters), name="parameter"),
            columns=["r_hat", "effective_sample_size", "converged"])

    def _title(self) -> str:
        how = {"MARKOV_CHAINS": "of Markov chains",
               "IMPORTANCE_SAMPLING": "of importance sampling, which has no chains and no R̂"}
        return f"{self.draw_count} draws {how.get(self.method, '')}".rstrip()

    def __repr__(self) -> str:
        return f"{self._title()}\n" + _html.text_table(
            _HEADER, [one._row() for one in self.parameters.values()])

    def _repr_html_(self) -> str:
        return _html.page(_html.paragraph(self._title()), _html.table(
            _HEADER, [one._row() for one in self.parameters.values()]))


def of_posterior(posterior: Posterior) -> Convergence:
    """Returns the convergence of a posterior's draws."""
    return Convergence(
        {name: ParameterConvergence(name, one.r_hat, one.effective_sample_size)
         for name, one in posterior.parameters.items()},
        posterior.method, posterior.draw_count)
