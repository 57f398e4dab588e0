"""Numbers and tables, as text and as HTML for notebooks."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence

_STYLE = ("<style>.polyest table{border-collapse:collapse}.polyest td,.polyest th"
          "{text-align:left;padding:.15em .7em}.polyest td.n{text-align:right;"
          "font-variant-numeric:tabular-nums}</style>")
_COLORS = {"IDENTIFIED": "#1a7f37", "WEAK": "#9a6700", "NOT_IDENTIFIED": "#cf222e"}


def number(value: float, digits: int = 5) -> str:
    """Returns a number with some significant digits."""
    return f"{value:.{digits}g}"


def uncertain(value: float, std_dev: float) -> str:
    """Returns a value and its standard deviation, to two digits of the latter."""
    if not (math.isfinite(value) and math.isfinite(std_dev) and std_dev > 0):
        return f"{number(value)} ± {number(std_dev, 2)}"
    decimals = 1 - math.floor(math.log10(std_dev))
    largest = max(abs(value), std_dev)
    if 0 <= decimals <= 6 and largest < 1e7:
        return f"{value:.{decimals}f} ± {std_dev:.{decimals}f}"
    exponent = math.floor(math.log10(largest))
    scale, digits = 10.0**exponent, max(decimals + exponent, 0)
    return f"({value / scale:.{digits}f} ± {std_dev / scale:.{digits}f})e{exponent}"


def interval(lower: float, upper: float) -> str:
    """Returns an interval with as many digits as its width needs."""
    width = upper - lower
    if not (math.isfinite(width) and width > 0):
        return f"{number(lower)} … {number(upper)}"
    largest = max(abs(lower), abs(upper))
    digits = max(2, math.floor(math.log10(largest)) - math.floor(math.log10(width)) + 3)
    return f"{lower:.{digits}g} … {upper:.{digits}g}"


def words(verdict: str) -> str:
    """Returns a verdict in words."""
    return verdict.lower().replace("_", " ")


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Returns an HTML table of cells of text; verdicts are coloured."""
    def cell(text: str) -> str:
        color = _COLORS.get(text)
        shown = html.escape(words(text) if color else text)
        return f'<td style="color:{color}">{shown}</td>' if color else f"<td>{shown}</td>"

    head = "".join(f"<th>{html.escape(name)}</th>" for name in header)
    body = "".join(f"<tr>{''.join(map(cell, row))}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def paragraph(text: str) -> str:
    """Returns a paragraph of HTML."""
    return f"<p>{html.escape(text)}</p>"


def page(*parts: str) -> str:
    """Returns parts of HTML as one element with its style."""
    return f'<div class="polyest">{_STYLE}{"".join(parts)}</div>'


def text_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Returns a table as text, its columns two spaces apart."""
    lines: list[Sequence[str]] = [header, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip()
                     for line in lines)
