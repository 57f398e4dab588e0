"""Arguments that cannot be meant: each is refused before it is sent, and the exception names it."""

import re

import numpy as np
import pytest

import polyest
from polyest import Noise, StreamOptions, _request
from polyest.problem import to_message


@pytest.mark.parametrize(("options", "said"), [
    ({"batch_rows": -5}, "batch_rows: -5 must be a whole number ≥ 1"),
    ({"batch_rows": 0}, "batch_rows: 0 must be a whole number ≥ 1"),
    ({"batch_rows": 2.5}, "batch_rows: 2.5 of the type float must be a whole number"),
    ({"max_unacknowledged": 0}, "max_unacknowledged: 0 must be a whole number ≥ 1"),
    ({"estimate_every": 0}, "estimate_every: 0 must be a whole number ≥ 1"),
    ({"estimate_interval_s": -1}, "estimate_interval_s: -1 must be a finite number ≥ 0"),
    ({"first_delay_s": np.nan}, "first_delay_s: nan must be a finite number ≥ 0"),
    ({"max_delay_s": "long"}, "max_delay_s: 'long' of the type str must be a number"),
    ({"max_attempts": True}, "max_attempts: True of the type bool must be a whole number"),
])
def test_options_of_a_stream_lose_no_rows_and_never_hang(options, said):
    with pytest.raises(polyest.InvalidInput, match=f"^{said}$") as raised:
        StreamOptions(**options)
    assert raised.value.field == next(iter(options))


def test_whole_numbers_of_numpy_are_such():
    assert StreamOptions(batch_rows=np.int64(5), estimate_every=None).batch_rows == 5


@pytest.mark.parametrize(("options", "said"), [
    ({"correlation": True}, 'correlation: True of the type bool must be a number, "auto" or None'),
    ({"correlation": "AUTO"}, "correlation: 'AUTO' of the type str"),
    ({"absolute": True}, "absolute: True of the type bool must be a number"),
    ({"full_scale": 0.0}, "full_scale: 0.0 must be > 0; None stands for the largest sample"),
    ({"white_share": 0.5}, "white_share: is a share of correlated noise, and correlation is None"),
])
def test_no_setting_of_noise_is_passed_over(options, said):
    with pytest.raises(polyest.InvalidInput, match=f"^{said}"):
        Noise(**options)


def test_the_daemon_is_asked_about_a_white_share_that_is_estimated(client, problem):
    noise = Noise(absolute=0.01, correlation="auto", white_share=0.5)
    found = client.check(problem.copy().measure("v", noise))
    assert [one.field for one in found.errors] == ["measured[1].noise.correlation.whiteShare"]


@pytest.mark.parametrize(("build", "said"), [
    (lambda problem: problem.fix(x0=True), "fixed.x0: true must be a number"),
    (lambda problem: problem.fix(v0=np.nan), "fixed.v0: NaN must be a finite number"),
    (lambda problem: problem.uncertain("m", polyest.Uniform(1, np.inf)),
     r"uncertain\[2\].uniform.upper: Infinity must be a finite number"),
    (lambda problem: problem.uncertain("m", polyest.Uniform(1, 2), drift=(1,)),
     r"drift: \(1,\) of the type tuple must be a number, or two"),
    (lambda problem: problem.process_noise("v", (1, "a")), "spectral_density: 'a' of the type str"),
    (lambda problem: problem.drive("force", polyest.Samples(["a"], [1])),
     r"time_s: \['a'\] of the type list must be numbers"),
    (lambda problem: problem.fix([1]), r"values: \[1\] of the type list must be a dict, numbers"),
    (lambda _: polyest.Problem.equations(states=None, outputs={}), "states: None of the type None"),
    (lambda _: polyest.Problem.equations(states={}, outputs={}, tables={"f": [1, 2, 3]}),
     r"tables.f: \[1, 2, 3\] of the type list must be two lists: places, and the values there"),
    (lambda problem: problem.measure("v", True), "noise: True of the type bool must be a number"),
])
def test_a_value_that_is_no_number_is_named(problem, build, said):
    with pytest.raises(polyest.InvalidInput, match=f"^{said}"):
        to_message(build(problem.copy()))


def test_a_long_table_is_looked_through_in_a_moment(problem):
    knots = np.arange(200_000.0)
    driven = to_message(problem.copy().drive("force", polyest.Samples(knots, knots)))
    assert len(driven.inputs[0].table.value) == 200_000


def test_a_check_lists_values_of_a_wrong_form_and_bad_data(client, problem, tmp_path):
    wrong = client.check({"model": {"builtin": "duffing"}, "fixed": {"m": "heavy"}})
    assert [str(one) for one in wrong.errors] == ['fixed.m: "heavy" must be a number']
    lost = client.check({"uncertain": [{"name": "k", "uniform": {"lower": None, "upper": 2}}]})
    assert [str(one) for one in lost.errors] == [
        "uncertain[0].uniform.lower: null must be a number"]
    order = client.check({"expansion": {"order": "auto"}})
    assert [str(one) for one in order.errors] == [
        'expansion.order: "auto" must be a whole number or "AUTO"']
    both = client.check(problem.copy().fix(k=1.0), {"t": [0.0, 1.0], "x": [0.0, np.inf]})
    assert [one.field for one in both.errors] == ["uncertain[0]", "x"]
    assert "inf is not finite" in str(both.errors[1]) and both.summary == []
    with pytest.raises(polyest.InvalidInput, match="cannot be opened"):
        client.check(tmp_path / "none.json")
    with pytest.raises(polyest.WrongType):
        client.check(5)


def test_signals_of_a_design_are_checked_as_those_of_a_problem(client, problem):
    experiment = client.experiment(problem)
    for signal, kind, said in (
            (5, polyest.WrongType, "candidates.s.force: 5 of the type int must be a signal"),
            (polyest.Step(np.nan), polyest.InvalidInput,
             "candidates.s.force.step.amplitude: NaN must be a finite number")):
        with pytest.raises(kind, match=said):
            experiment.design(1.0, candidates={"s": {"force": signal}})


def test_the_daemon_s_errors_name_arguments(client, problem, rows):
    experiment = client.experiment(problem, rows(0, 20))
    session = client.session("with-rows", problem)
    session.append(rows(0, 20))
    for call, argument in (
            (lambda: experiment.predict(draws=1), "draws"),
            (lambda: experiment.predict(max_rows=-1), "max_rows"),
            (lambda: experiment.sensitivity(-1.0), "until_s"),
            (lambda: next(session.predictions(draws=1)), "draws"),
            (lambda: client.session("m", problem, reorder_window_s=-1), "reorder_window_s"),
            (lambda: experiment.design(1.0, outputs={"q": 1.0}), r"outputs[0]"),
            (lambda: client.session("Not a name", problem), "name")):
        with pytest.raises(polyest.InvalidInput, match=f"^{re.escape(argument)}: ") as raised:
            call()
        assert raised.value.field == argument


def test_what_a_message_cannot_take_is_named(client, problem, rows, tmp_path):
    file = tmp_path / "kept"
    with client.session("typed", problem) as session:
        session.append(rows(0, 20))
        session.export(file)
        for call, argument in (
                (lambda: next(session.predictions(draws=2.5)), "draws"),
                (lambda: session.predict(times=[1.0], run="first"), "run"),
                (lambda: client.session(5, problem), "name"),
                (lambda: client.session("typed", problem, reorder_window_s="long"),
                 "reorder_window_s"),
                (lambda: client.import_session(file, 5), "name")):
            with pytest.raises(polyest.WrongType) as raised:
                call()
            assert raised.value.field == argument
    client.delete_session("typed")


def test_errors_about_a_problem_keep_the_names_of_its_file(client, problem, rows):
    with pytest.raises(polyest.InvalidInput) as raised:
        client.estimate(problem.copy().integrate(max_steps=-1), rows(0, 20))
    assert raised.value.field == "integration.maxSteps"


@pytest.mark.parametrize(("options", "said"), [
    ({"token": b"secret"}, "^token: a value of the type bytes must be a text$"),
    ({"timeout_s": "a"}, "^timeout_s: 'a' of the type str must be a number$"),
    ({"timeout_s": np.nan}, "^timeout_s: nan must be ≥ 0$"),
])
def test_options_of_a_connection_are_checked_at_once(options, said):
    with pytest.raises(polyest.InvalidInput, match=said):
        polyest.connect("127.0.0.1:1", **options)


def test_a_problem_file_that_cannot_be_written_is_named(problem, tmp_path):
    with pytest.raises(polyest.InvalidInput, match="none/file: cannot be written: No such file"):
        problem.save(tmp_path / "none" / "file")


def test_a_grid_without_a_finite_cost_is_not_drawn():
    pytest.importorskip("matplotlib")
    nowhere = np.full(3, np.inf)
    axis = polyest.results.Axis("k", "N/m", np.arange(3.0))
    grid = polyest.results.CostGrid([axis], nowhere, nowhere, nowhere, 0)
    with pytest.raises(polyest.InvalidInput, match="grid: its cost is finite nowhere"):
        grid.plot()


def test_numbers_are_those_of_python_and_numpy():
    assert _request.number("n", np.float32(0.5)) == 0.5
    for value in (True, np.bool_(True), None, [1], "a"):
        with pytest.raises(polyest.WrongType, match="^n: "):
            _request.number("n", value)


@pytest.mark.parametrize(("call", "said"), [
    (lambda one: one.predict(times=[[1.0, 2.0]]),
     r"times: has the shape \(1, 2\); times have one dimension"),
    (lambda one: one.predict(run="a"), "run: 'a' of the type str must be a whole number"),
    (lambda one: one.predict(times=[1.0], run=-1), "run: -1 must be a whole number ≥ 0"),
    (lambda one: one.posterior(joints=5), "joints: 5 of the type int must be pairs of names"),
    (lambda one: one.history(0), "points: 0 must be a whole number ≥ 1"),
])
def test_arguments_of_studies_are_not_passed_over(client, problem, rows, call, said):
    with pytest.raises(polyest.InvalidInput, match=f"^{said}"):
        call(client.experiment(problem, rows(0, 20)))


def test_a_stream_is_not_begun_with_options_that_are_none(client, problem, rows):
    for options, said in (({"options": {"batch_rows": 5}}, "options: .* must be a polyest.Stream"),
                          ({"on_estimate": 5}, "on_estimate: 5 of the type int must be a function")):
        with pytest.raises(polyest.WrongType, match=f"^{said}"):
            client.session("not-begun", problem, **options)
    with pytest.raises(polyest.NotFound):
        client.session("not-begun")
    session = client.session("end-of-run", problem)
    with pytest.raises(polyest.WrongType, match="^end_of_run: 'no' of the type str must be True or"):
        session.append(rows(0, 20), end_of_run="no")
    assert session.append(rows(0, 20), end_of_run=np.bool_(True)) == 1
