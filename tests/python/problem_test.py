"""The builder of problems: the same file as by hand, the daemon's own checks."""

import json
import re

import numpy as np
import pytest

import polyest
from conftest import EXAMPLES
from polyest.problem import to_message


def test_a_built_problem_is_the_file_of_the_example(problem):
    assert problem == polyest.Problem.read(EXAMPLES / "oscillator.json")


@pytest.mark.parametrize("file", sorted(EXAMPLES.glob("*.json")), ids=lambda file: file.stem)
def test_every_example_is_read_and_saved_without_a_change(file, tmp_path):
    problem = polyest.Problem.read(file)
    problem.save(tmp_path / "saved.json")
    assert polyest.Problem.read(tmp_path / "saved.json").as_dict() == json.loads(file.read_text())


def test_everything_that_a_problem_may_say(client):
    problem = (
        polyest.Problem.equations(
            states={"x": "v", "v": "(u - force)/m"}, outputs={"x": "x", "v": "v"},
            parameters={"m": 1.0}, inputs=["u"], intermediates={"force": "k*x + c*v"}))
    (problem.fix({"x_0": 0.1}, m=2.0)
     .uncertain("k", polyest.Lognormal(40, 5))
     .uncertain("v_0", polyest.TruncatedNormal(0, 1, lower=-2, upper=2), per_run=True)
     .uncertain("u.gain", polyest.Beta(2, 2, 0.5, 1.5))
     .uncertain("x.offset", polyest.Gamma(4, 0.1))
     .uncertain("d", polyest.Normal(0.2, 0.03))
     .correlate("k", "d", 0.3)
     .derive("c", "2*d")
     .drive("u", polyest.Chirp(1.0, 0.1, 5.0, duration_s=10.0))
     .measure("x", polyest.Noise(unknown=True, correlation="auto", outliers="HUBER"),
              column="Disp", unit="mm")
     .measure("v", polyest.Noise(absolute=0.1, relative=0.01, correlation=0.2, white_share=0.1))
     .expand(order=2, points_per_term=3.0, points="HAMMERSLEY")
     .integrate(method="EXPLICIT", relative_tolerance=1e-6)
     .regularize(2.0).use_when("t > 0.5"))
    message = to_message(problem)
    assert message.measured[1].noise.correlation.time_constant_s == 0.2
    assert message.columns["x"].unit == "mm"
    check = problem.check(client=client)
    fields = {finding.field.split("[")[0].split(".")[0] for finding in check.errors}
    # What is refused is a combination that the daemon does not allow, never a field's name or form.
    assert fields <= {"uncertain", "measured", "derived", "correlations", "fixed"}, str(check)


def test_process_noise_and_drift_are_written_as_in_the_examples():
    disturbed = (
        polyest.Problem.builtin("mass_spring_damper").fix(m=1.0, x0=1.0)
        .uncertain("k", polyest.Uniform(31.58, 47.37)).uncertain("c", polyest.Uniform(0.05, 1))
        .measure("x", polyest.Noise(absolute=0.005)).process_noise("v", (1e-4, 1)))
    assert disturbed == polyest.Problem.read(EXAMPLES / "disturbed.json")
    warming = (
        polyest.Problem.builtin("mass_spring_damper").fix(m=1.0)
        .drive("force", polyest.Sinusoid(2, 1))
        .uncertain("k", polyest.Uniform(31.58, 47.37))
        .uncertain("c", polyest.Lognormal(1, 0.4), drift=(0.001, 1))
        .measure("x", polyest.Noise(absolute=0.005)))
    assert warming == polyest.Problem.read(EXAMPLES / "warming.json")
    limited = polyest.Problem({}).expand(max_replay_row_count=20000)
    assert limited.as_dict() == {"expansion": {"maxReplayRowCount": 20000}}
    specimens = (
        polyest.Problem.builtin("mass_spring_damper").fix(m=1, x0=1, c=0.23)
        .uncertain("k", polyest.Normal(40, 4), per_run=True, population=True).measure("x", 0.05))
    assert specimens == polyest.Problem.read(EXAMPLES / "specimens.json")
    known = polyest.Problem({}).uncertain("c", polyest.Normal(1, 0.4), drift=0.05)
    assert known.as_dict()["uncertain"][0]["drift"] == {"randomWalk": {"stdDevPerSqrtS": 0.05}}
    table = polyest.Problem.equations(states={"x": "-f(x)"}, outputs={"x": "x"},
                                      tables={"f": ([0, 1, 3], [0, 2, 3])})
    assert table.as_dict()["model"]["equations"]["tables"] == {
        "f": {"x": [0, 1, 3], "value": [0, 2, 3]}}
    streamed = polyest.Problem({}).stream("u", interpolation="LINEAR").as_dict()["inputs"]
    assert streamed == [{"name": "u", "streamed": {"interpolation": "LINEAR"}}]


@pytest.mark.parametrize(("document", "field", "rule"), [
    ({"fixed": {"v0": "a"}}, r"fixed\.v0$", '^"a" must be a number$'),
    ({"uncertian": []}, "uncertian", 'unknown field; did you mean "uncertain"'),
    ({"measured": [{"output": "x", "nose": 1}]}, r"measured\[0\].nose",
     'unknown field; did you mean "noise"'),
    ({"expansion": {"points": "MANY"}}, "expansion.points", '"MANY" must be one of HALTON'),
])
def test_a_value_of_the_wrong_form_is_refused_with_field_and_rule(document, field, rule):
    with pytest.raises(polyest.InvalidInput) as raised:
        to_message(document)
    assert re.match(field, raised.value.field), raised.value.field
    assert re.search(rule, raised.value.rule), raised.value.rule


@pytest.mark.parametrize("signal", [
    polyest.Constant(1.0), polyest.Step(1.0, 0.5), polyest.Sinusoid(1.0, 2.0, 0.1),
    polyest.Chirp(1.0, 0.1, 5.0, 10.0), polyest.HalfSineBump(1.0, 0.5, 0.2),
    polyest.Samples([0.0, 1.0], [0.0, 1.0], interpolation="LINEAR"),
    polyest.Samples([0.0, 1.0], [0.0, 1.0], hold=True, amplitude=2.0), polyest.Streamed(),
    polyest.Streamed(hold=True), polyest.Streamed(interpolation="SHAPE_PRESERVING"),
], ids=lambda signal: type(signal).__name__)
def test_every_signal_is_accepted(client, problem, signal):
    check = client.check(problem.copy().drive("force", signal))
    assert check.ok, str(check)


@pytest.mark.parametrize("prior", [
    polyest.Uniform(30, 50), polyest.Normal(40, 2), polyest.Beta(2, 3, 30, 50),
    polyest.Gamma(4, 2, 30), polyest.Lognormal(40, 5), polyest.TruncatedNormal(40, 5, lower=30),
], ids=lambda prior: type(prior).__name__)
def test_every_prior_is_accepted(client, prior):
    check = client.check(polyest.Problem.builtin("mass_spring_damper").uncertain("k", prior)
                         .measure("x", 0.01))
    assert check.ok, str(check)


def test_all_faults_are_found_at_once_in_the_daemons_words(client, problem):
    wrong = problem.copy().uncertain("x0", polyest.Uniform(2, 1)).measure("nothing", 0.01)
    check = wrong.check(client=client)
    assert not check.ok and len(check.errors) == 3
    assert any(finding.field.startswith("uncertain[2]") for finding in check.errors)
    with pytest.raises(polyest.InvalidInput) as raised:
        check.raise_for_errors()
    assert raised.value.field == check.errors[0].field
    assert "error" in check._repr_html_() and str(check).startswith("error: ")


def test_a_check_looks_at_the_data(client, problem, record):
    good = problem.check(record, client=client)
    assert good.ok and any(remark.topic == "data" for remark in good.summary)
    good.raise_for_errors()
    late = {"t": record["t"] + 1000.0, "x": record["x"]}
    assert problem.check(late, client=client).warnings


def test_what_is_no_problem_is_refused_before_anything_is_opened(tmp_path):
    # `open` would take the number for a descriptor: it would close what another part has opened.
    with open(tmp_path / "other", "w+") as other:
        number = other.fileno()
        for call in (polyest.Problem.read, to_message):
            with pytest.raises(TypeError, match="a problem must be a polyest.Problem, a dict, or "
                               rf"the path .*; got {number} of the type int"):
                call(number)
        with pytest.raises(TypeError):
            polyest.Problem().save(number)
        other.write("still open")
    for wrong in (None, True, b"problem.json", ["problem.json"]):
        with pytest.raises(TypeError, match="a problem must be"):
            to_message(wrong)


def test_the_word_auto_is_the_default_order(problem):
    document = problem.as_dict()
    document["expansion"] = {"order": "AUTO"}
    assert to_message(document) == to_message({**document, "expansion": {}})


def test_a_copy_is_independent(problem):
    copy = problem.copy().fix(m=2.0)
    assert problem.as_dict()["fixed"]["m"] == 1.0 and copy != problem
    assert "uncertain k, c" in repr(problem)


def test_the_schema_of_problem_files_is_json(client):
    assert "uncertain" in json.loads(client.problem_schema())["properties"]


def test_numbers_of_numpy_are_written_as_others(tmp_path):
    made = (polyest.Problem.builtin("mass_spring_damper").fix(m=np.int64(1), x0=np.float32(0.5))
            .uncertain("k", polyest.Uniform(np.float32(31.5), np.int64(47)))
            .measure("x", noise=np.float32(0.25)))
    made.save(tmp_path / "problem.json")
    assert json.loads(made.as_json())["fixed"] == {"m": 1, "x0": 0.5}
    assert polyest.Problem.read(tmp_path / "problem.json") == made
    with pytest.raises(TypeError, match="of the type set"):
        polyest.Problem({"fixed": {"m": {1.0}}}).as_json()


@pytest.mark.parametrize(("document", "said"), [
    ({"uncertain": [{"name": "k", "uniform": {"lower": "low"}}]},
     'uncertain[0].uniform.lower: "low" must be a number'),
    ({"uncertain": [{"uniform": {}, "normal": {}}]},
     "uncertain[0]: normal and uniform are both given; only one of uniform, normal, "),
    ({"expansion": {"order": 2.5}}, "expansion.order: 2.5 must be a whole number"),
    ({"expansion": {"order": 1e10}},
     "expansion.order: 10000000000.0 must be a whole number below 2^31"),
    ({"expansion": {"points": "SOBOL"}},
     'expansion.points: "SOBOL" must be one of HALTON, '),
    ({"expansion": {"adaptive": 3}}, "expansion.adaptive: 3 must be true or false"),
    ({"fixed": {"m": [1]}}, "fixed.m: a list must be a number"),
    ({"uncertain": {"name": "k"}}, "uncertain: an object must be a list, in brackets [ ]"),
    ({"uncertain": [{"name": 5}]}, "uncertain[0].name: 5 must be a text in quotes"),
])
def test_a_wrong_value_is_refused_in_plain_words(document, said):
    with pytest.raises(polyest.InvalidInput) as raised:
        to_message(document)
    assert raised.value.message.startswith(said)
    assert raised.value.message == f"{raised.value.field}: {raised.value.rule}"


@pytest.mark.parametrize(("build", "said"), [
    (lambda one: one.uncertain("k", 5), "prior: 5 of the type int must be a prior"),
    (lambda one: one.uncertain("k", polyest.Uniform), "prior: "),
    (lambda one: one.drive("force", 5), "signal: 5 of the type int must be a signal"),
    (lambda one: one.measure("x", "loud"), "noise: 'loud' of the type str must be a number"),
    (lambda one: one.regularize(None), "weight: None of the type NoneType must be a number"),
])
def test_what_is_no_part_of_a_problem_is_named(build, said):
    with pytest.raises(polyest.WrongType) as raised:
        build(polyest.Problem.builtin("mass_spring_damper"))
    assert raised.value.message.startswith(said)
