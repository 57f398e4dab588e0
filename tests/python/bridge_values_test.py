"""Values that the bridge publishes: the names of parameters, and what the status shows."""

import pytest

import polyest
from polyest._parameters import ParameterNames
from polyest._proto.v1 import estimate_pb2
from polyest.bridge._values import check_path, in_words
from polyest.estimates import of_message
from polyest.problem import to_message

NAMES = ParameterNames(to_message(
    polyest.Problem.builtin("mass_spring_damper")
    .uncertain("K[1,1]", polyest.Uniform(1, 2))
    .uncertain("A[2]", polyest.Uniform(1, 2))
    .uncertain("k", polyest.Normal(40, 4), per_run=True, population=True)
    .uncertain("m", polyest.Uniform(1, 2), per_run=True, population=True)
    .uncertain("x0", polyest.Uniform(-1, 1), per_run=True)
    .uncertain("c", polyest.Uniform(0, 1), drift=(0.01, 1.0))
    .uncertain("g", polyest.Uniform(0, 1), drift=0.1)
    .process_noise("v", (1e-4, 1.0)).process_noise("x", 0.1)))


@pytest.mark.parametrize("path", [
    "K[1,1].mean", "A[2].map", "k.mean.mean", "k.spread.std_dev", "k[3].lower95", "m.median.mean",
    "x0[12].mean", "c.mean", "c.drift.mean", "processNoise.v.mean", "time"])
def test_every_parameter_of_an_estimate_can_be_published(path):
    check_path("signals.S", path, NAMES)


@pytest.mark.parametrize(("path", "said"), [
    ("K.mean", r"no uncertain parameter 'K'"),
    ("K[1,2].mean", "no uncertain parameter"), ("A[3].mean", "no uncertain parameter"),
    ("x0.mean", r"no uncertain parameter 'x0'; there are .*'x0\[0\]'"),
    ("k.mean", "no uncertain parameter 'k'"), ("m.mean.mean", "no uncertain parameter 'm.mean'"),
    ("g.drift.mean", "no uncertain parameter"), ("processNoise.x.mean", "no uncertain parameter"),
    ("c.size", "is no value of an estimate")])
def test_others_are_refused_with_those_that_there_are(path, said):
    with pytest.raises(polyest.InvalidInput, match=f"signals.S: .*{said}"):
        check_path("signals.S", path, NAMES)


def test_the_status_shows_what_tables_show():
    said = {"name": "k", "map": 1.5, "std_dev": 0.5, "mean": 2.0, "posterior_std_dev": 0.25}
    verdicts = estimate_pb2.Identifiability
    message = estimate_pb2.Estimate(parameters=[
        estimate_pb2.ParameterEstimate(**said, verdict=verdict)
        for verdict in (verdicts.IDENTIFIED, verdicts.NOT_IDENTIFIED)])
    assert in_words(of_message(message)) == "k = 1.50 ± 0.50, k = 2.00 ± 0.25"
