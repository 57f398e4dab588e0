"""Runs the notebooks, cell by cell as a kernel does, and looks at what they have found."""

import ast
import json

import matplotlib.pyplot as plt
import numpy as np
import pytest

from conftest import ROOT, TRUTH

NOTEBOOKS = ROOT / "client" / "python" / "examples"


def run(name, monkeypatch):
    """Runs a notebook in its folder; returns its variables."""
    monkeypatch.chdir(NOTEBOOKS)
    variables = {"__name__": "__main__"}
    for number, cell in enumerate(json.loads((NOTEBOOKS / name).read_text())["cells"]):
        if cell["cell_type"] != "code":
            continue
        assert not cell["outputs"], f"{name}: cell {number} is stored with outputs"
        tree = ast.parse("".join(cell["source"]), f"{name}[{number}]")
        shown = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, f"{name}[{number}]", "exec"), variables)
        if shown is not None:
            value = eval(compile(ast.Expression(shown.value), f"{name}[{number}]", "eval"),
                         variables)
            getattr(value, "_repr_html_", lambda: None)()
            assert repr(value)
    plt.close("all")
    return variables


def test_first_estimate(monkeypatch):
    found = run("first_estimate.ipynb", monkeypatch)["estimate"]
    for name, value in TRUTH.items():
        assert found[name].lower95 < value < found[name].upper95
    assert not found.diagnostics


def test_live_rig(monkeypatch, capsys):
    variables = run("live_rig.ipynb", monkeypatch)
    assert "40 batches sent, 40 kept, with 400 samples" in capsys.readouterr().out
    for name, value in TRUTH.items():
        found = variables["estimate"][name]
        assert abs(found.mean - value) < 4 * found.std_dev


def test_identifiability(monkeypatch):
    variables = run("identifiability.ipynb", monkeypatch)
    released, pushed = variables["estimate"], variables["pushed"]
    assert {one.combination for one in released.trade_offs} & {"k/m", "m/k", "c/m", "k/c", "c/k"}
    for name in ("m", "k"):
        assert not released[name].identified
        assert pushed[name].std_dev < 0.1 * released[name].std_dev
    assert variables["design"].candidates[-1].name == "release again"
    for name, value in variables["TRUTH"].items():
        assert pushed[name].identified
        assert abs(pushed[name].mean - value) < 4 * pushed[name].std_dev


def test_comparison_with_emcee(monkeypatch):
    pytest.importorskip("emcee")
    variables = run("comparison_with_emcee.ipynb", monkeypatch)
    posterior, exact = variables["posterior"], variables["exact"]
    for column, name in enumerate(("k", "c")):
        sd, error = exact[:, column].std(), 1 / np.sqrt(variables["independent"][column])
        assert abs(posterior[name].mean - exact[:, column].mean()) < (4 * error + 0.02) * sd
        # A standard deviation of n draws scatters by 1/√(2n) of it.
        assert abs(posterior[name].std_dev / sd - 1) < 4 * error / np.sqrt(2) + 0.02
