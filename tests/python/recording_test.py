"""How samples of channels with times of their own become rows, without any file."""

import asyncio
from time import monotonic

import numpy as np
import pytest

import polyest
from polyest.io import Batch, Recording, _assembler
from polyest.io._assembler import Assembler
from polyest.io._choices import nearest, spelled, units_of
from polyest.io._merge import merged
from polyest.io._ordered import ordered
from polyest.io._rows import batches, nanoseconds

SECOND = 10**9
NAN = float("nan")


def halves(rows):
    """A recording of the oscillator in batches of 50 rows."""
    def read():
        for first in range(0, 200, 50):
            part = rows(first, first + 50)
            yield Batch(part["t"], {"x": 1000 * part["x"]}, {"x": "mm"})
    return Recording("halves", {"x": "mm"}, read)


def test_a_batch_has_times_units_and_what_is_missing():
    found = Batch(np.array([0.0, 1.0]), {"x": np.array([NAN, 2.0])}, {"x": "mm"}, 3).measurements()
    assert list(found.time_s) == [0, 1] and list(found.run) == [3, 3]
    channel, = found.channels
    assert (channel.name, channel.unit, list(channel.missing)) == ("x", "mm", [0])
    assert channel.values[1] == 2


def test_recordings_go_where_data_go(client, problem, rows):
    recording = halves(rows)
    expected = client.estimate(problem, rows(0, 200)).to_dict()["parameters"]
    assert client.estimate(problem, recording.all().to_dict() | {"x": recording.all().values["x"]},
                           units={"x": "mm"}).samples == 200
    one = client.estimate(problem, recording)
    for name in one.names:  # a product by 1000 and its quotient differ by a rounding
        assert abs(one[name].map - next(
            other["map"] for other in expected if other["name"] == name)) < 1e-9
    with client.session("recorded", problem) as session:
        assert session.append(recording, end_of_run=True) == 5
        assert session.estimate().to_dict()["parameters"] == one.to_dict()["parameters"]
    assert list(recording.to_dataframe().columns) == ["x"]
    assert client.check(problem, recording).ok


def test_recordings_go_into_sessions_of_asyncio(client, problem, rows):
    async def run():
        async with polyest.aio.connect(client.server) as other:
            async with await other.session("recorded-too", problem) as session:
                await session.append(halves(rows))
                return await session.estimate()

    assert asyncio.run(run()).samples == 200


def test_a_session_may_take_rows_out_of_order(client, problem, rows):
    first, second = rows(0, 50), rows(50, 100)
    with client.session("window", problem, reorder_window_s=5.0) as session:
        session.append(second)
        session.append(first, end_of_run=True)
        found = session.estimate().to_dict()["parameters"]
    assert found == client.estimate(problem, rows(0, 100)).to_dict()["parameters"]
    assert client.session("window", problem, reorder_window_s=5.0).name == "window"
    assert client.session("window", problem).name == "window"
    with pytest.raises(polyest.AlreadyExists, match="exists with reorder_window_s = 5.0, not 0"):
        client.session("window", problem, reorder_window_s=0.0)

    async def again():
        async with polyest.aio.connect(client.server) as other:
            with pytest.raises(polyest.AlreadyExists, match="reorder_window_s"):
                await other.session("window", problem, reorder_window_s=1.0)
            return (await other.session("window", problem, reorder_window_s=5.0)).name

    assert asyncio.run(again()) == "window"


def test_a_session_with_a_window_takes_each_channel_by_itself(client, problem, rows):
    driven = problem.copy().stream("force")
    part = rows(0, 100)
    force = 0 * part["x"]
    with client.session("apart", driven, reorder_window_s=10.0) as session:
        session.append({"t": part["t"], "force": force})
        session.append(part, end_of_run=True)
        found = session.estimate().to_dict()["parameters"]
    assert found == client.estimate(driven, {**part, "force": force}).to_dict()["parameters"]


@pytest.mark.parametrize("seed", range(20))
def test_merged_tracks_are_the_union_of_their_samples(seed):
    random = np.random.default_rng(seed)
    tracks, expected = [], {}
    for name in ("a", "b", "c")[:1 + seed % 3]:
        times = np.unique(random.integers(0, 60, random.integers(0, 40))) / 4
        values = np.where(random.random(len(times)) < 0.2, NAN, random.random(len(times)))
        cuts = np.sort(random.integers(0, len(times) + 1, 4))
        tracks.append(iter([(part, {name: value}) for part, value in zip(
            np.split(times, cuts), np.split(values, cuts))]))
        expected[name] = {time: value for time, value in zip(times, values)
                          if not np.isnan(value)}
    if not any(expected.values()):
        return
    found = list(batches("file", merged("file", tracks), dict.fromkeys(expected, ""), run=0,
                         time_zero="file", batch_rows=7))
    times = np.concatenate([batch.time_s for batch in found])
    assert (np.diff(times) > 0).all() and max(map(len, found)) <= 7
    assert list(times) == sorted(set().union(*expected.values()))
    for name, samples in expected.items():
        values = np.concatenate([batch.values[name] for batch in found])
        assert {time: value for time, value in zip(times, values)
                if not np.isnan(value)} == samples


@pytest.mark.parametrize("count", [1, 3, 100])
def test_samples_in_any_order_within_the_window_make_the_same_rows(count):
    random = np.random.default_rng(1)
    times = np.arange(50)
    order = np.argsort(times + random.uniform(0, 5, 50))  # each at most 5 s late
    samples = [(int(time) * SECOND, {"a": float(time)}) for time in times[order]]
    found = list(batches("file", ordered("file", samples, 5.0, count), {"a": ""}, run=0,
                         time_zero="auto", batch_rows=100))
    assert list(np.concatenate([batch.values["a"] for batch in found])) == list(times)


def test_whole_nanoseconds_are_the_floats_of_the_decimal_numbers():
    assert nanoseconds(0.1) == 100_000_000
    assert nanoseconds(1_790_000_000.123456) == 1_790_000_000_123_456_000
    pieces = [{"a": (np.array([1_790_000_000 * SECOND + 7 * 10**k for k in range(9)]),
                     np.zeros(9))}]
    found, = batches("file", pieces, {"a": ""}, run=0, time_zero="file", batch_rows=10)
    assert found.time_s[0] == 1_790_000_000
    found, = batches("file", [{"a": (pieces[0]["a"][0] - 1_790_000_000 * SECOND, np.zeros(9))}],
                     {"a": ""}, run=0, time_zero="file", batch_rows=10)
    assert [repr(float(time)) for time in found.time_s[-3:]] == ["0.007", "0.07", "0.7"]


def rows_of(assembler, **options):
    return [(batch.run, list(batch.time_s), {name: list(values) for name, values in
                                             batch.values.items()})
            for batch in assembler.take(**options)]


def test_samples_of_one_time_make_one_row_and_late_ones_are_counted():
    one = Assembler({"a": "", "b": ""}, 0.0)
    one.add(5 * SECOND, {"a": 1.0})
    one.add(6 * SECOND, {"a": 2.0})
    (run, times, values), = rows_of(one)  # the newest row may still be filled
    assert (run, times, values["a"]) == (0, [0], [1])
    one.add(6 * SECOND, {"b": 3.0})
    one.add(6 * SECOND, {"b": 4.0})
    one.add(5 * SECOND, {"b": 5.0})
    assert rows_of(one, last=True) == [(0, [1], {"a": [2], "b": [3]})]
    assert (one.repeated, one.late) == (1, 1)


def test_a_window_takes_late_samples_but_none_twice():
    one = Assembler({"a": "", "b": ""}, 1.0)
    one.add(0, {"a": 1.0})
    one.add(2 * SECOND, {"a": 2.0})
    one.take()
    one.add(round(1.5 * SECOND), {"a": 3.0})
    one.add(2 * SECOND, {"b": 4.0})  # another channel at a time that was sent
    one.add(2 * SECOND, {"a": 5.0})
    one.add(round(0.5 * SECOND), {"a": 6.0})
    (_, times, values), = rows_of(one)
    assert times == [1.5, 2.0]
    np.testing.assert_array_equal(values["a"], [3, NAN])
    np.testing.assert_array_equal(values["b"], [NAN, 4])
    assert (one.repeated, one.late) == (1, 1)


def test_a_gap_begins_a_new_run():
    one = Assembler({"a": ""}, 0.0, new_run_after_s=10.0)
    one.add(0, {"a": 1.0})
    one.add(10 * SECOND, {"a": 2.0})
    one.add(21 * SECOND, {"a": 3.0})
    assert [(run, times) for run, times, _ in rows_of(one, last=True)] == [(0, [0, 10]), (1, [0])]
    assert one.new_runs == 1


def test_a_clock_that_is_set_back_begins_a_new_run_after_a_while(monkeypatch):
    now = [monotonic()]
    monkeypatch.setattr(_assembler, "monotonic", lambda: now[0])
    one = Assembler({"a": ""}, 0.0, patience_s=5.0)
    one.add(100 * SECOND, {"a": 1.0})
    one.add(50 * SECOND, {"a": 2.0})
    now[0] += 5.1
    one.add(101 * SECOND, {"a": 3.0})  # the clock is right
    one.add(51 * SECOND, {"a": 4.0})
    now[0] += 5.1
    one.add(52 * SECOND, {"a": 5.0})
    one.add(53 * SECOND, {"a": 6.0})
    found = rows_of(one, last=True)
    assert [(run, times) for run, times, _ in found] == [(0, [0, 1]), (1, [0, 1])]
    assert one.late == 2


def test_a_run_goes_on_after_the_last_row():
    one = Assembler({"a": ""}, 0.0, run=2, origin_ns=10 * SECOND, after_s=5.0)
    for time in (14, 15, 16):
        one.add(time * SECOND, {"a": 1.0})
    assert [(run, times) for run, times, _ in rows_of(one, last=True)] == [(2, [6])]
    assert one.late == 2


def test_a_run_with_a_window_goes_on_with_what_may_be_missing():
    one = Assembler({"a": "", "b": ""}, 2.0, run=1, origin_ns=0, after_s=5.0)
    for time in (3, 4, 5, 6):
        one.add(time * SECOND, {"a": 1.0, "b": 2.0})
    found = rows_of(one)
    # Up to 5 s the session may have one channel's sample and lack the other's.
    assert [times for _, times, _ in found] == [[4], [4], [5], [5], [6]]
    np.testing.assert_array_equal(found[0][2]["a"], [1])
    np.testing.assert_array_equal(found[0][2]["b"], [NAN])
    assert one.late == 2
    assert [one.may_be_kept(1, time) for time in (5.0, 5.1)] == [True, False]
    assert not one.may_be_kept(2, 1.0)


def test_names_and_units_are_found_as_people_write_them():
    assert nearest("DEFL", ["SUSP.defl", "road", "SUSP.deflection"])[0] == "SUSP.defl"
    assert [spelled(unit) for unit in ("1/min", "Nm", " mm ", "m/s²", "-")] == [
        "rpm", "N m", "mm", "m/s²", "1"]
    assert units_of({"x": "mm", "y": "Nm"}, {"x": ""}) == {"x": "", "y": "N m"}
