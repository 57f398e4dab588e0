"""Problem files that cannot be used: the package says what the command `polyest` says."""

import os
import pathlib
import re
import subprocess

import numpy as np
import pytest

import polyest
from polyest.problem import from_message, to_message

NOT_JSON = [
    b'{"fixed": {"m": 1},}', b'{"measured": [\n1,\n]}', b"{'fixed': {}}", b"{fixed: {}}",
    b'{"fixed": {"m": NaN}}', b'{"fixed": {"m": -Infinity}}', b'{"fixed": {"m": 0x10}}',
    b'{"fixed": {"m": .5}}', b'{"fixed": {"m": 01}}', b'{"fixed": {"m": 1e999}}',
    b'{"fixed": {"m": True}}', b'{"fixed" {}}', b'{"fixed": {}\n "uncertain": []}', b'{"fixed": {}',
    b'{"fixed": {}}}', b'{"fixed": {}} {}', b'{"fixed": {"m": 1} // mass\n}', b"# note\n{}",
    b'{"model": {"builtin": "a\tb"}}', b'{"model": {"builtin": "a\nb"}}', b'{"model": {"fmu": "C:\\d"}}',
    b'{"model": {"fmu": "\\u12"}}', b'{"model": {"fmu": "\\ud83d"}}', b'{"model": {"fmu": "\xf6"}}',
    b'{"model": {"fmu": "', b"{,}", b"]", b"nonsense", b"[" * 100_000, b'{"a":' * 101,
    b'{"fixed": {"m": 1}, "fixed": {"m": 2}}', b'{"fixed": {"m": 1,\n "m": 2}}',
    b'{"uncertain": [{}, {"uniform": {"lower": 1, "lower": 1, "upper": 2}}]}',
    b'{"fixed": {"m": 1, "m": 2}, "fixed": {}}', b'{"measured": [null]}',
    b'\xef\xbb\xbf\n{"fixed" 1}', b'{"fixed": {"m": 1, "\\u006d": 2}}',
]
NO_PROBLEM = [
    b"", b" \n", b"[]", b"t,x\n0,1\n", b"t\n0\n", b"model: a, b\n",
    b'{"uncertain": [{"name": "k", "normal": {"mean": 1, "stdDev": 1, "std_dev": 2}}]}', b'{"modle": {}}', b'{"modle": {}, "uncertain": [{"unifrom": {}}]}',
    b'{"uncertain": [{"name": "k", "uniform": {"upper": 47.4}}]}',
    b'{"uncertain": [{"name": "k", "uniform": {"lower": -1}}]}',
    b'{"uncertain": [{"name": "k", "uniform": {}}]}',
    b'{"uncertain": [{}, {"name": "k", "beta": {"alpha": 2, "beta": 2, "upper": 1}}]}',
    b'{"fixed": {"m": "heavy"}}', b'{"expansion": {"order": "three"}}',
]


def said_by_the_command(file):
    program = pathlib.Path(os.environ["POLYEST_DAEMON"]).with_name("polyest")
    done = subprocess.run([program, "check", file], capture_output=True, text=True, check=False)
    return done.stderr.splitlines()[0].removeprefix("polyest: ")


@pytest.mark.parametrize("text", NOT_JSON, ids=lambda text: ascii(text)[2:40])
def test_what_is_not_json_is_refused_as_the_command_does(tmp_path, text):
    file = tmp_path / "problem.json"
    file.write_bytes(text)
    assert said_by_the_command(file).startswith(f"{file}:")
    with pytest.raises(polyest.InvalidInput, match=f"^{re.escape(str(file))}:[^\n]*$"):
        to_message(file)


@pytest.mark.parametrize("text", NO_PROBLEM, ids=lambda text: ascii(text)[2:40])
def test_json_that_is_no_problem_is_refused_in_the_command_s_words(tmp_path, text):
    file = tmp_path / "problem.json"
    file.write_bytes(text)
    with pytest.raises(polyest.InvalidInput) as raised:
        to_message(file)
    assert raised.value.message == said_by_the_command(file)


@pytest.mark.parametrize(("text", "field", "rule"), [
    ('{"fixed": {"m": 1, "m": 2}}', "fixed.m", "given twice"),
    ('{"fixed": {"m": NaN}}', "", "NaN is no number of JSON"),
])
def test_programs_are_told_the_field_and_the_rule(tmp_path, text, field, rule):
    (tmp_path / "problem.json").write_text(text)
    with pytest.raises(polyest.InvalidInput) as raised:
        polyest.Problem.read(tmp_path / "problem.json")
    assert (raised.value.field, raised.value.rule) == (field, rule)


def nested(depth):
    found = 1
    for _ in range(depth):
        found = {"a": found}
    return found


@pytest.mark.parametrize("make", [to_message, polyest.Problem,
                                  lambda document: polyest.Problem().fix(m=document).as_dict(),
                                  lambda document: polyest.Problem().fix(m=document).as_json()])
def test_what_is_nested_too_deep_is_refused(make):
    endless = {}
    endless["a"] = endless
    for document in (nested(101), nested(5000), {"fixed": nested(5000)}, endless):
        with pytest.raises(polyest.InvalidInput, match="^the problem: dicts and lists are nested "
                           "more than 100 deep$"):
            make(document)
    assert polyest.Problem(nested(100)).as_dict() == nested(100)


@pytest.mark.parametrize(("document", "said"), [
    (5, "document: 5 of the type int must be a dict"),
    ("problem.json", "document: 'problem.json' of the type str must be a dict"),
    ({1: 2}, "problem: 1 of the type int must be a text, as the name of a field"),
    ({"fixed": {None: 2.0, "m": 1}}, "fixed: None of the type NoneType must be a text"),
    ({"fixed": {"m": 10**400}}, "fixed.m: a long number must be a finite number"),
    ({"fixed": {"m": 1j}}, "fixed.m: 1j must be a number"),
    ({"fixed": {"\ud800": 1.0}}, r'fixed: "\\ud800" must be a text without halves of characters'),
    ({"model": {"builtin": "\ud800"}}, r'model.builtin: "\\ud800" must be a text without halves'),
    ({"uncertain": [{"name": "k", "uniform": {"upper": 2}}]},
     r"uncertain\[0\].uniform.lower: is missing; the uniform prior of k needs lower and upper"),
])
def test_a_document_that_is_no_problem_is_refused_in_one_sentence(document, said):
    with pytest.raises(polyest.InvalidInput, match=f"^{said}[^\n]*$"):
        to_message(polyest.Problem(document))


@pytest.mark.parametrize(("document", "build", "said"), [
    ({"fixed": [1]}, lambda one: one.fix(m=1), "fixed: .* must be an object, in braces"),
    ({"measured": {}}, lambda one: one.measure("x", 1), "measured: .* must be a list, in brackets"),
    ({"expansion": 5}, lambda one: one.expand(order=2), "expansion: 5 of the type int"),
    ({}, lambda one: one.column(["x"], "a"), "quantity: .* must be a text"),
    ({}, lambda one: one.derive(5, "k"), "name: 5 of the type int must be a text"),
    ({"fixed": {"m": np.nan}}, lambda one: one.as_json(), "fixed.m: nan must be a finite number"),
    ({"fixed": {"m": {1}}}, lambda one: one.as_json(), r"\{1\} of the type set is nothing that"),
])
def test_what_cannot_be_added_or_written_is_named(document, build, said):
    with pytest.raises(polyest.InvalidInput, match=f"^{said}"):
        build(polyest.Problem(document))


def test_null_stands_for_a_part_that_is_not_given():
    problem = polyest.Problem({"fixed": None, "measured": None}).fix(m=1.0).measure("x", 0.1)
    assert problem.as_dict()["fixed"] == {"m": 1.0} and len(problem.as_dict()["measured"]) == 1


def test_numpy_s_arrays_and_tuples_are_lists():
    table = {"timeS": np.arange(3), "value": (0, np.float32(0.5), 1)}
    document = {"inputs": ({"name": "force", "table": table},)}
    assert list(to_message(document).inputs[0].table.value) == [0.0, 0.5, 1.0]


def test_problems_that_are_none_can_be_compared_and_shown():
    odd = polyest.Problem({"uncertain": [1], "measured": 5, "model": {"a": {1}}})
    assert odd == odd.copy() and odd != polyest.Problem()
    assert repr(odd).startswith("<polyest.Problem: ")


def test_a_bound_of_0_stays_when_a_problem_comes_back():
    made = (polyest.Problem.builtin("mass_spring_damper").uncertain("k", polyest.Uniform(0, 50))
            .uncertain("c", polyest.Beta(2, 2, -1, 0)).measure("x", 0.1))
    back = from_message(to_message(made))
    assert back == made and back.as_dict()["uncertain"][0]["uniform"] == {"lower": 0, "upper": 50}


def test_a_path_that_cannot_be_one_is_refused():
    with pytest.raises(polyest.InvalidInput, match=re.escape(r"a\0b: cannot be opened: embedded")):
        polyest.Problem.read("a\0b")
