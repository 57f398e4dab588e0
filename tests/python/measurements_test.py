"""How data become measurements, without a daemon: columns, units, times, runs, missing samples."""

import datetime
import time

import numpy as np
import pandas as pd
import pytest

import polyest
from polyest._measurements import MeasurementConverter, split
from polyest.io import Batch, Recording
from polyest.problem import to_message

MEASURED = polyest.Problem.builtin("quarter_car").measure("x", 0.1)
DRIVEN = MEASURED.copy().stream("u")


def converter(problem=MEASURED, units=None, **options):
    return MeasurementConverter(to_message(problem), units, **options)


def values_of(measurements):
    return {channel.name: list(channel.values) for channel in measurements.channels}


def test_columns_of_the_problem_are_taken_and_others_are_named():
    with pytest.warns(UserWarning, match="are not used: note"):
        found = converter(DRIVEN).convert({"t": [0.0, 1.0], "u": [1, 2], "x": [3, 4],
                                           "note": [5, 6]})
    assert list(found.time_s) == [0.0, 1.0]
    assert values_of(found) == {"x": [3, 4], "u": [1, 2]}


def test_missing_samples_are_rows_counted_from_zero():
    found = converter().convert({"t": [0.0, 1.0, 2.0], "x": [np.nan, 2.0, np.nan]})
    assert list(found.channels[0].missing) == [0, 2]
    assert np.isfinite(found.channels[0].values).all()


def test_nullable_columns_of_pandas_have_missing_samples():
    frame = pd.DataFrame({"t": [0.0, 1.0], "x": pd.array([1, None], dtype="Int64")})
    assert list(converter().convert(frame).channels[0].missing) == [1]


@pytest.mark.parametrize("kind", ["object", "string", "category"])
@pytest.mark.parametrize("text", ["a", "0.5"])
def test_a_text_column_of_pandas_is_refused_only_where_it_is_used(kind, text):
    texts = pd.Series([text, None]).astype(kind)
    frame = pd.DataFrame({"t": [0.0, 1.0], "x": [1.0, 2.0], "note": texts})
    with pytest.warns(UserWarning, match="are not used: note"):
        assert values_of(converter().convert(frame)) == {"x": [1.0, 2.0]}
    with pytest.raises(polyest.InvalidInput, match="x: has values of type .*must have numbers"):
        converter().convert(pd.DataFrame({"t": [0.0, 1.0], "x": texts}))


def test_objects_with_none_have_missing_samples():
    found = converter().convert({"t": [0.0, 1.0], "x": [None, 2.0]})
    assert list(found.channels[0].missing) == [0]


@pytest.mark.parametrize("kind", [float, int, bool, object])
def test_what_a_masked_array_hides_is_missing(kind):
    hidden = np.ma.array(np.array([1, 0, 1], dtype=kind), mask=[True, False, False])
    table = np.ma.array([(0.0, 1.0), (1.0, 0.0), (2.0, 1.0)], dtype=[("t", float), ("x", float)],
                        mask=[(False, True), (False, False), (False, False)])
    for data in ({"t": [0.0, 1.0, 2.0], "x": hidden}, table):
        channel, = converter().convert(data).channels
        assert list(channel.missing) == [0] and list(channel.values)[1:] == [0, 1]


def test_a_hidden_time_is_no_time():
    dates = np.array(["2026-01-31", "2026-02-01"], dtype="datetime64[s]")
    for times in (np.array([0.0, 1.0]), dates):
        with pytest.raises(polyest.InvalidInput, match=r"t: row 1 \(counted from 0\) has no time"):
            converter().convert({"t": np.ma.array(times, mask=[False, True]), "x": [1.0, 2.0]})


@pytest.mark.parametrize("header", ["x [mm]", "x (mm)", "x / mm"])
def test_a_header_may_have_the_unit(header):
    channel = converter().convert({"t": [0.0], header: [1.0]}).channels[0]
    assert (channel.name, channel.unit) == ("x", "mm")


def test_a_given_unit_goes_before_that_of_the_header_and_of_the_problem():
    problem = polyest.Problem.builtin("quarter_car").measure("x", 0.1, column="Disp", unit="cm")
    data = {"t": [0.0], "Disp [mm]": [1.0]}
    assert converter(problem).convert(data).channels[0].unit == "cm"
    assert converter(problem, {"x": "m"}).convert(data).channels[0].unit == "m"


def test_a_column_that_the_problem_names_must_exist():
    problem = polyest.Problem.builtin("quarter_car").measure("x", 0.1, column="Disp")
    with pytest.raises(polyest.InvalidInput, match="no column 'Disp'; the columns are 't', 'x'"):
        converter(problem).convert({"t": [0.0], "x": [1.0]})


@pytest.mark.parametrize("data", [
    {"t": [0.0], "x": [1.0]}, pd.DataFrame({"x": [1.0]}, index=pd.Index([0.0], name="t")),
    Batch(np.array([0.0]), {"x": np.array([1.0])}),
    Recording("r", {"x": ""}, lambda: iter([Batch(np.array([0.0]), {"x": np.array([1.0])})])),
], ids=lambda data: type(data).__name__)
def test_the_column_of_a_streamed_input_must_be_there(data):
    with pytest.raises(polyest.InvalidInput, match="^measurements: the column 'u' for the streamed "
                       "input of that name is missing; the columns are ('t', )?'x'$"):
        converter(DRIVEN).convert(data)
    with pytest.raises(polyest.InvalidInput, match="the column 'u' for the streamed input"):
        list(converter(DRIVEN).convert_each(data))


def test_a_missing_column_is_told_with_the_line_that_maps_the_nearest_one():
    data = {"t": [0.0], "x": [1.0], "note": [2.0], "U [mm]": [3.0]}
    with pytest.raises(polyest.InvalidInput, match=r"""'U \[mm\]'; map one in the problem: """
                       r""""columns": {"u": {"from": "U \[mm\]"}}$"""):
        converter(DRIVEN).convert(data)


def test_an_input_may_have_no_sample_where_it_has_a_column():
    found = converter(DRIVEN).convert({"t": [0.0], "x": [1.0], "u": [np.nan]})
    assert list(found.channels[1].missing) == [0]


def test_later_batches_may_lack_a_slow_input():
    one = converter(DRIVEN)
    assert len(list(one.convert_each({"t": [0.0], "x": [1.0], "u": [1.0]}))) == 1
    found, = one.convert_each({"t": [1.0], "x": [2.0]})
    assert values_of(found) == {"x": [2.0]}


def test_channels_may_come_apart_where_rows_may_come_in_any_order():
    one = converter(DRIVEN, apart=True)
    assert values_of(one.convert({"t": [0.0], "x": [1.0]})) == {"x": [1.0]}
    assert values_of(one.convert({"t": [0.0], "u": [1.0]})) == {"u": [1.0]}
    with pytest.raises(polyest.InvalidInput, match=r"no column of the problem \(x, u\); .* 'y'"):
        one.convert({"t": [0.0], "y": [1.0]})


@pytest.mark.parametrize(("name", "said"), [
    ("X", "units: there is no quantity 'X' in the problem; there are 't', 'x', 'u'; "
     "the nearest is 'x'"),
    ("travel", "units: there is no quantity 'travel' in the problem; there are 't', 'x', 'u'$"),
    ("run", "there is no quantity 'run'"),
])
def test_a_unit_of_an_unknown_name_is_refused_with_the_known_ones(name, said):
    with pytest.raises(polyest.InvalidInput, match=said) as raised:
        converter(DRIVEN, {name: "mm"})
    assert raised.value.field == "units"


def test_units_may_be_given_by_the_header_that_the_problem_names():
    problem = MEASURED.copy().column("x", "Disp")
    channel, = converter(problem, {"Disp": "mm"}).convert({"t": [0.0], "Disp": [1.0]}).channels
    assert (channel.name, channel.unit) == ("x", "mm")


def test_columns_of_the_condition_must_be_there():
    problem = MEASURED.copy().use_when("abs(v) > 1e2*pi && t > 1")
    data = {"t": [0.0], "x": [1.0]}
    with pytest.raises(polyest.InvalidInput, match="column 'v', which useWhen names, is missing"):
        converter(problem).convert(data)
    assert values_of(converter(problem).convert({**data, "v": [2.0]})) == {"x": [1.0], "v": [2.0]}


def test_columns_of_the_condition_are_sent():
    problem = polyest.Problem.builtin("quarter_car").measure("x", 0.1).use_when("v > 5 && !rev")
    found = converter(problem).convert({"t": [0.0], "x": [1.0], "v": [6.0], "rev": [False]})
    assert values_of(found) == {"x": [1.0], "v": [6.0], "rev": [0.0]}


def test_runs_are_whole_numbers():
    found = converter().convert({"t": [0.0, 0.0], "run": [0, 1], "x": [1.0, 2.0]})
    assert list(found.run) == [0, 1]
    for run in (0.5, -1, 3e9, float("nan")):
        said = r"run: row 1 \(counted from 0\): .* must be a whole number from"
        with pytest.raises(polyest.InvalidInput, match=said):
            converter().convert({"t": [0.0, 0.1], "run": [0, run], "x": [1.0, 1.0]})


def test_columns_of_lists_are_refused():
    with pytest.raises(polyest.InvalidInput, match="x: is no column of numbers"):
        converter().convert({"t": [0.0, 0.1], "x": [[1.0], [1.0, 2.0]]})


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e-3), ("min", 60.0), ("s", 1.0)])
def test_times_are_converted(unit, factor):
    found = converter(units={"t": unit}).convert({"t": [0.0, 2.0], "x": [1.0, 2.0]})
    np.testing.assert_allclose(found.time_s, [0.0, 2 * factor])


def test_dates_count_from_the_first_row_of_all_batches():
    times = pd.date_range("2026-01-31T13:00:00", periods=4, freq="250ms")
    frame = pd.DataFrame({"x": np.arange(4.0)}, index=times)
    one = converter()
    assert list(one.convert(frame[:2]).time_s) == [0.0, 0.25]
    assert list(one.convert(frame[2:]).time_s) == [0.5, 0.75]


def test_dates_with_a_time_zone_count_as_others():
    times = pd.date_range("2026-01-31T13:00:00", periods=2, freq="250ms", tz="Europe/Berlin")
    found = converter().convert(pd.DataFrame({"t": times, "x": [1.0, 2.0]}))
    assert list(found.time_s) == [0.0, 0.25]


def test_dates_without_a_time_zone_are_in_none(monkeypatch):
    # Berlin skips the hour from 2:00 on; numpy and pandas, and so the daemon's times, do not.
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    dates = [datetime.datetime(2026, 3, 29, 1, 59, 59), datetime.datetime(2026, 3, 29, 3)]
    zone = datetime.timezone(datetime.timedelta(hours=2))
    for given in (dates, np.array(dates, dtype="datetime64[ns]"), pd.Series(dates),
                  [date.replace(tzinfo=zone) for date in dates]):
        assert list(converter().convert({"t": given, "x": [1.0, 2.0]}).time_s) == [0.0, 3601.0]
    monkeypatch.undo()
    time.tzset()


def test_a_time_of_day_is_no_date():
    with pytest.raises(polyest.InvalidInput, match=r"^t: row 0 \(counted from 0\): .* of the type "
                       "time must be a date with its time"):
        converter().convert({"t": [datetime.time(1, 2, 3)], "x": [1.0]})


def test_a_date_that_is_missing_does_not_begin_the_time():
    one, dates = converter(), np.array(["NaT", "2026-01-31T13:00:05"], dtype="datetime64[ns]")
    with pytest.raises(polyest.InvalidInput, match=r"t: row 0 \(counted from 0\) has no time"):
        one.convert({"t": dates, "x": [1.0, 2.0]})
    assert list(one.convert({"t": dates[1:], "x": [2.0]}).time_s) == [0.0]


def test_time_differences_are_times():
    index = pd.to_timedelta([0.0, 0.5], unit="s")
    found = converter().convert(pd.DataFrame({"x": [1.0, 2.0]}, index=index))
    assert list(found.time_s) == [0, 0.5]


@pytest.mark.parametrize(("data", "said"), [
    ({"x": [1.0]}, "t: no column of the time; the columns are 'x'"),
    ({"t": [0.0], "y": [1.0]}, r"no column of a measured output \(x\); the columns are 't', 'y'"),
    ({"t": [0.0, 1.0], "x": [1.0]}, "columns differ in length: t 2, x 1"),
    ({"t": [0.0], "x": [np.inf]}, r"x: row 0 \(counted from 0\): inf is not finite"),
    ({"t": [np.nan], "x": [1.0]}, r"t: row 0 \(counted from 0\) has no time"),
    ({"t": [0.0], "x": ["fast"]}, "x: has values of type"),
    ({"t": [0.0], "x": [[1.0]]}, r"x: has the shape \(1, 1\)"),
    ([1.0, 2.0], "a list has no columns"),
])
def test_what_cannot_be_meant_is_refused_with_the_rule(data, said):
    with pytest.raises(polyest.InvalidInput, match=said):
        converter().convert(data)


@pytest.mark.parametrize("unit", ["mm", "Ms"])
def test_an_unknown_unit_of_time_names_those_that_are_known(unit):
    with pytest.raises(polyest.InvalidInput, match=f"'{unit}' is no unit of time; known are s, ms"):
        converter(units={"t": unit}).convert({"t": [0.0], "x": [1.0]})


@pytest.mark.parametrize(("unit", "seconds"), [
    ("sec", 1.0), ("MSEC", 1e-3), ("µsec", 1e-6), (" ms ", 1e-3), ("Minuten", 60.0),
    ("hours", 3600.0),
    ("S", 1.0)])
def test_units_of_time_are_spelled_as_measuring_systems_do(unit, seconds):
    found = converter(units={"t": unit}).convert({"t": [0.0, 2.0], "x": [1.0, 1.0]})
    assert list(found.time_s) == [0.0, 2 * seconds]


@pytest.mark.parametrize(("headers", "said"), [
    (("x [mm]", "x (m)"), r"x: may be the column 'x \[mm\]', 'x \(m\)'; columns.x.from of the"),
    (("t [ms]", "t (s)"), r"t: may be the column 't \[ms\]', 't \(s\)'")])
def test_a_column_with_two_readings_is_refused(headers, said):
    data = {"t": [0.0], "x": [1.0], **{header: [2.0] for header in headers}}
    del data[headers[0][0]]
    with pytest.raises(polyest.InvalidInput, match=said):
        converter().convert(data)
    # The whole header decides, as it does for the command.
    data[headers[0][0]] = [3.0]
    with pytest.warns(UserWarning, match="are not used"):
        assert len(converter().convert(data).time_s) == 1


@pytest.mark.parametrize("units", [["x"], {"x": 5}, 5])
def test_units_are_texts_by_name(units):
    with pytest.raises(polyest.WrongType, match="^units"):
        converter(units=units)


def test_a_split_record_has_the_same_rows():
    times = np.arange(10.0)
    signal = np.where(times % 3 == 0, np.nan, times)
    whole = converter().convert({"t": times, "x": signal, "run": times // 5}, end_of_run=True)
    parts = list(split(whole, 4))
    assert [len(part.time_s) for part in parts] == [4, 4, 2]
    assert [part.end_of_run for part in parts] == [False, False, True]
    assert [time for part in parts for time in part.time_s] == list(whole.time_s)
    assert [run for part in parts for run in part.run] == list(whole.run)
    missing = [first + row for first, part in zip((0, 4, 8), parts)
               for row in part.channels[0].missing]
    assert missing == list(whole.channels[0].missing)


def test_texts_with_decimal_commas_are_refused_with_what_reads_them():
    data = {"t": [0.0, 0.1], "x": np.array(["nan", "0,81"], dtype=object)}
    with pytest.raises(polyest.InvalidInput, match=r"x: row 1 .*'0,81' is a text with a decimal "
                       r"comma; pandas.read_csv\(…, sep=\";\", decimal=\",\"\)"):
        converter().convert(data)


def test_a_unit_may_stand_behind_an_underscore():
    found = converter().convert({"t_ms": [0.0, 1000.0], "x_mm": [1.0, 2.0]})
    assert list(found.time_s) == [0.0, 1.0]
    assert [(one.name, one.unit) for one in found.channels] == [("x", "mm")]
    with pytest.raises(polyest.InvalidInput, match="no column of a measured output"):
        converter().convert({"t": [0.0], "x_in": [1.0]})
    with pytest.raises(polyest.InvalidInput, match="x: may be the column 'x_mm', 'x_cm'"):
        converter().convert({"t": [0.0], "x_mm": [1.0], "x_cm": [0.1]})
    mapped = MEASURED.copy().measure("x_m", 0.1)
    with pytest.warns(UserWarning, match="x_km"):
        both = converter(mapped).convert({"t": [0.0], "x": [1.0], "x_m": [2.0], "x_km": [3.0]})
    assert values_of(both) == {"x": [1.0], "x_m": [2.0]}
