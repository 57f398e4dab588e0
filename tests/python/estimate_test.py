"""One-shot estimates: the numbers, and the forms in which data and problems may come."""

import json
import os
import pathlib
import subprocess

import numpy as np
import pandas as pd
import pytest

import polyest
from conftest import EXAMPLES, TRUTH
from polyest._proto.v1 import estimate_pb2
from polyest.estimates import of_message


@pytest.fixture(scope="module")
def estimate(client, record):
    """The estimate of the example, from its problem file."""
    return client.estimate(EXAMPLES / "oscillator.json", record)


def test_intervals_contain_the_values_that_made_the_data(estimate):
    for name, value in TRUTH.items():
        assert estimate[name].lower95 < value < estimate[name].upper95
        assert estimate[name].identified
    # χ² of N samples has the mean N and the standard deviation √(2N).
    channel = estimate.channels[0]
    assert abs(channel.chi_squared - channel.samples) < 4 * np.sqrt(2 * channel.samples)


def test_arrays_have_their_documented_shapes(estimate):
    assert estimate.names == ["k", "c"]
    assert estimate.covariance.shape == (2, 2)
    np.testing.assert_allclose(np.sqrt(np.diag(estimate.covariance)), estimate.std_dev, rtol=1e-9)
    np.testing.assert_allclose(np.diag(estimate.correlation), 1.0)
    assert estimate.map.tolist() == [estimate["k"].map, estimate["c"].map]


def test_a_parameter_that_does_not_exist_is_named_with_those_that_do(estimate):
    with pytest.raises(KeyError, match="no parameter 'm'; there are k, c"):
        estimate["m"]
    assert "k" in estimate and "m" not in estimate and len(estimate) == 2


def test_every_form_of_problem_and_data_gives_the_same_estimate(client, problem, record, estimate):
    frame = pd.DataFrame(record)
    structured = np.genfromtxt(EXAMPLES / "oscillator.csv", delimiter=",", names=True)
    document = json.loads((EXAMPLES / "oscillator.json").read_text())
    for wanted, data in ((problem, frame), (document, structured),
                         (str(EXAMPLES / "oscillator.json"), frame.set_index("t"))):
        assert client.estimate(wanted, data).to_dict() == estimate.to_dict()


def test_units_are_converted(client, problem, record, estimate):
    data = {"t": record["t"] * 1e3, "x": record["x"] * 1e3}
    converted = client.estimate(problem, data, units={"x": "mm", "t": "ms"})
    # Conversion rounds times and samples in their last digit, which may move the points at which
    # the model is expanded; that error is small beside the standard deviation.
    assert np.all(np.abs(converted.map - estimate.map) < 0.05 * estimate.std_dev)
    np.testing.assert_allclose(converted.std_dev, estimate.std_dev, rtol=0.05)
    in_header = client.estimate(problem, {"t [ms]": data["t"], "x (mm)": data["x"]})
    assert in_header.to_dict() == converted.to_dict()


def test_missing_samples_are_left_out(client, problem, record):
    data = {name: values.copy() for name, values in record.items()}
    data["x"][100:300] = np.nan
    found = client.estimate(problem, data)
    assert found.samples == len(record["t"]) - 200
    assert found["k"].lower95 < TRUTH["k"] < found["k"].upper95


def test_an_estimate_is_a_table_of_numbers(estimate):
    frame = estimate.to_dataframe()
    assert list(frame.index) == ["k", "c"]
    assert frame.loc["k", "mean"] == estimate["k"].mean
    assert frame.loc["c", "verdict"] == "IDENTIFIED"
    assert json.loads(estimate.to_json())["parameters"][0]["priorStdDev"] == pytest.approx(
        (47.376 - 31.584) / np.sqrt(12))


def test_notebooks_show_values_units_and_verdicts(estimate):
    html = estimate._repr_html_()
    for shown in ("41.2976 ± 0.0032", "N/m", "identified", "χ²"):
        assert shown in html
    assert "k          41.2976 ± 0.0032" in repr(estimate)


def test_the_dictionary_is_what_the_command_prints(tmp_path, problem, rows, client):
    problem.save(tmp_path / "problem.json")
    data = rows(0, 100)
    lines = ["t,x", *(f"{float(t)!r},{float(x)!r}" for t, x in zip(data["t"], data["x"]))]
    (tmp_path / "data.csv").write_text("\n".join(lines) + "\n")
    program = pathlib.Path(os.environ["POLYEST_DAEMON"]).with_name("polyest")
    done = subprocess.run([program, "estimate", tmp_path / "problem.json", tmp_path / "data.csv",
                           "--server", client.server, "--format", "json"],
                          capture_output=True, text=True, check=True)
    found = client.estimate(problem, data)
    assert found.diagnostics == [] and found.to_dict()["diagnostics"] == []
    assert found.to_dict() == json.loads(done.stdout)


def test_tables_show_one_value_of_a_parameter():
    def parameter(verdict, posterior_std_dev):
        message = estimate_pb2.ParameterEstimate(
            name="k", map=1.5, std_dev=0.5, mean=2.0, posterior_std_dev=posterior_std_dev,
            prior_std_dev=2.0, verdict=verdict)
        return of_message(estimate_pb2.Estimate(parameters=[message]))

    verdicts = estimate_pb2.Identifiability
    for verdict, deviation, shown, text in (
            (verdicts.IDENTIFIED, 0.25, (1.5, 0.5), "1.50 ± 0.50"),
            (verdicts.WEAK, 0.9, (1.5, 0.5), "1.50 ± 0.50"),
            (verdicts.WEAK, 1.0, (2.0, 1.0), "2.0 ± 1.0"),
            (verdicts.NOT_IDENTIFIED, 0.25, (2.0, 0.25), "2.00 ± 0.25"),
            (verdicts.NOT_IDENTIFIED, 0.0, (1.5, 0.5), "1.50 ± 0.50")):
        found = parameter(verdict, deviation)
        assert found["k"].shown == shown
        assert text in repr(found) and text in found._repr_html_()


def test_an_unidentified_parameter_is_told_in_words(client, problem, record):
    found = client.estimate(problem.copy().uncertain("force.offset", polyest.Normal(0, 1e-6)),
                            record)
    assert found["force.offset"].verdict == "NOT_IDENTIFIED"
    assert found.has("NOT_IDENTIFIED")
    assert "not identified" in found._repr_html_()


def test_without_a_client_a_daemon_of_its_own_answers(problem, record, estimate):
    assert polyest.estimate(problem, record).to_dict() == estimate.to_dict()
