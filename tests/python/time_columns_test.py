"""Which columns are the time: the same for the package as for the command `polyest`."""

import os
import pathlib
import re
import subprocess

import numpy as np
import pandas as pd
import pytest

import polyest
from conftest import ROOT
from polyest import _time_columns
from polyest._measurements import MeasurementConverter
from polyest.problem import to_message

PROBLEM = (polyest.Problem.builtin("mass_spring_damper").uncertain("k", polyest.Uniform(31, 47))
           .measure("x", 0.1))

HEADERS = [
    *_time_columns.NAMES, "Time", "TIME", "Zeit", "Timestamp", "T", "Zeitpunkt", "X", "clock", "ts",
    *(f"t{ending}" for ending in _time_columns.ENDINGS), "Zeit_ms", "T_s", "time_h", "t_mm",
    *(f"Zeit [{unit}]" for unit in (
        "s", "ms", "mm", "N", "hh:mm:ss", "UTC", "min", "g", "°C", "sec", "Sekunden", "%")),
    *(f"time ({unit})" for unit in ("s", "ms", "mm", "hh:mm:ss", "h")),
    "t / s", "t/ms", "t / mm", "t in s", "Zeit in min", "time in h", "time in mm", "T [s]",
    "T in s", " t ", "t [m s] x", "date/time [s]", "[s]", "t[ms]", "t**2", "t s", "t / (s)",
]


def converted(header):
    data = {header: [0.0, 1.0, 2.0], "x": [1.0, 0.5, 0.2]}
    return MeasurementConverter(to_message(PROBLEM)).convert(data)


def test_the_same_columns_are_the_time_as_for_the_command(tmp_path):
    PROBLEM.save(tmp_path / "problem.json")
    program = pathlib.Path(os.environ["POLYEST_DAEMON"]).with_name("polyest")
    differ = []
    for header in HEADERS:
        (tmp_path / "data.csv").write_text(f"{header},x\n0,1\n1,0.5\n2,0.2\n")
        done = subprocess.run([program, "check", "problem.json", "data.csv"], cwd=tmp_path,
                              capture_output=True, text=True, check=False)
        is_time = "no column is the time" not in done.stderr
        try:
            converted(header)
            said = ""
        except polyest.InvalidInput as error:
            said = error.message
        if is_time != ("no column of the time" not in said):
            differ.append((header, done.stderr, said))
    assert differ == []


def test_names_are_those_of_the_command():
    def rows(file, start, row):
        text = (ROOT / file).read_text()
        return re.findall(row, text[text.index(start):].partition("};")[0])

    names = "client/cpp/data/column_names.cc"
    assert tuple(rows(names, "kTimeNames[]", r'"([^"]*)"')) == _time_columns.NAMES
    assert tuple(rows(names, "kTimeEndings[]", r'"([^"]*)"')) == _time_columns.ENDINGS


@pytest.mark.parametrize(("header", "seconds"), [
    ("Zeit", 1.0), ("Timestamp", 1.0), ("Zeit [ms]", 1e-3), ("t / min", 60.0), ("time in h", 3600.0),
    ("elapsed_time", 1.0), ("time_ms", 1e-3)])
def test_times_are_converted_from_the_unit_of_their_column(header, seconds):
    np.testing.assert_allclose(converted(header).time_s, [0.0, seconds, 2 * seconds])


def test_several_columns_that_may_be_the_time_are_refused_unless_one_is_t():
    data = {"Zeit": [0.0, 1.0], "timestamp": [5.0, 6.0], "x": [1.0, 2.0]}
    one = MeasurementConverter(to_message(PROBLEM))
    with pytest.raises(polyest.InvalidInput, match="t: may be the column 'Zeit', 'timestamp'; "
                       "columns.t.from of the problem decides"):
        one.convert(data)
    with pytest.warns(UserWarning, match="not used: Zeit, timestamp"):
        assert list(one.convert({**data, "t": [7.0, 8.0]}).time_s) == [7.0, 8.0]
    mapped = MeasurementConverter(to_message(PROBLEM.copy().column("t", "timestamp")))
    with pytest.warns(UserWarning, match="not used: Zeit"):
        assert list(mapped.convert(data).time_s) == [5.0, 6.0]


def test_a_quantity_of_the_problem_is_no_time():
    problem = PROBLEM.copy().use_when("elapsed > 1")
    data = {"elapsed": [0.0, 1.0], "x": [1.0, 2.0]}
    with pytest.raises(polyest.InvalidInput, match="no column of the time"):
        MeasurementConverter(to_message(problem)).convert(data)


def test_a_column_of_the_time_that_the_problem_names_must_be_there():
    mapped = to_message(PROBLEM.copy().column("t", "stamp"))
    with pytest.raises(polyest.InvalidInput, match="^columns.t: there is no column 'stamp'; the "
                       "columns are 't', 'x'$"):
        MeasurementConverter(mapped).convert({"t": [0.0], "x": [1.0]})


def test_an_index_with_the_name_of_a_time_is_the_time():
    frame = pd.DataFrame({"x": [1.0, 2.0]}, index=pd.Index([0.0, 500.0], name="Zeit [ms]"))
    one = MeasurementConverter(to_message(PROBLEM))
    assert list(one.convert(frame).time_s) == [0.0, 0.5]
    frame.index.name = "T"
    with pytest.raises(polyest.InvalidInput, match="no column of the time"):
        one.convert(frame)


def test_texts_of_dates_are_refused_with_what_reads_them():
    data = {"Zeit": ["2026-01-31 13:00:00", "2026-01-31 13:00:01"], "x": [1.0, 2.0]}
    with pytest.raises(polyest.InvalidInput, match=r"^Zeit: has texts; .*pandas\.to_datetime"):
        MeasurementConverter(to_message(PROBLEM)).convert(data)
