"""MDF files: two rates, chunks, units, invalid samples, names; against the command's own CSV."""

import sys

import numpy as np
import pytest

import polyest
from polyest.io import mdf
from rig import PROBLEM, TRUTH, estimate_of_csv, record, same, write_csv

asammdf = pytest.importorskip("asammdf")
# asammdf's files that were never open complain when they are deleted.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")

CHANNELS = {"x": "SUSP.defl", "force": "ROAD.force"}


def write(path, *groups, version="4.10", compression=0):
    """Writes groups of signals: lists of (name, unit, times, values[, invalid])."""
    with asammdf.MDF(version=version) as file:
        for number, group in enumerate(groups):
            file.append([asammdf.Signal(
                np.asarray(values), times, name=name, unit=unit, encoding="utf-8",
                invalidation_bits=invalid[0] if invalid else None)
                for name, unit, times, values, *invalid in group], acq_name=f"group {number}")
        file.save(path, overwrite=True, compression=compression)
    return path


@pytest.fixture(scope="module")
def data():
    return record()


@pytest.fixture
def ride(tmp_path, data):
    fine, x, coarse, force = data
    return write(tmp_path / "ride.mf4", [("SUSP.defl", "mm", fine, x)],
                 [("ROAD.force", "N", coarse, force)], compression=2)


@pytest.fixture(params=[100_000, 333], ids=["at once", "in parts"])
def reads(request, monkeypatch):
    """Reads so many samples of a channel at a time."""
    monkeypatch.setattr(mdf, "_READ", request.param)


@pytest.mark.parametrize("batch_rows", [10_000, 500])
def test_two_rates_give_the_estimate_of_the_same_rows_in_csv(client, tmp_path, data, ride,
                                                             batch_rows, reads):
    write_csv(tmp_path / "ride.csv", *data)
    expected = estimate_of_csv(tmp_path, tmp_path / "ride.csv")
    recording = mdf.read(ride, CHANNELS, batch_rows=batch_rows)
    found = client.estimate(PROBLEM, recording)
    # All numbers are the same to the last bit, and so are those that come of them.
    assert same(found, expected)
    assert found.samples == len(data[0])
    for name, value in TRUTH.items():
        assert abs(found[name].mean - value) < 5 * found[name].std_dev + 0.01 * value


def test_a_session_takes_a_file_batch_by_batch(client, ride):
    with client.session("ride", PROBLEM) as session:
        assert session.append(mdf.read(ride, CHANNELS, batch_rows=500)) > 4
        session.end_run()
        found = session.estimate()
    expected = client.estimate(PROBLEM, mdf.read(ride, CHANNELS))
    assert found.to_dict()["parameters"] == expected.to_dict()["parameters"]
    client.delete_session("ride")


def test_rows_are_those_times_at_which_a_channel_was_sampled(data, ride, reads):
    fine, x, coarse, force = data
    found = mdf.read(ride, CHANNELS, batch_rows=77).all()
    np.testing.assert_array_equal(found.time_s, np.union1d(fine, coarse))
    np.testing.assert_array_equal(found.values["x"][np.isin(found.time_s, fine)], x)
    assert np.isnan(found.values["x"][~np.isin(found.time_s, fine)]).all()
    np.testing.assert_array_equal(found.values["force"][np.isin(found.time_s, coarse)], force)
    assert np.isfinite(found.values["force"]).sum() == len(coarse)
    assert found.units == {"x": "mm", "force": "N"}


def test_batches_are_bounded_and_do_not_change_the_rows(ride):
    batches = list(mdf.read(ride, CHANNELS, batch_rows=100))
    assert max(map(len, batches)) <= 100
    assert len(batches) > 40
    whole = mdf.read(ride, CHANNELS).to_dict()
    for name, column in whole.items():
        np.testing.assert_array_equal(np.concatenate([one.to_dict()[name] for one in batches]),
                                      column)


@pytest.mark.parametrize("version", ["3.30", "4.10", "4.11"])
def test_versions_are_read_alike(tmp_path, version):
    times = np.arange(5) / 4
    path = write(tmp_path / f"file.{'mdf' if version < '4' else 'mf4'}",
                 [("defl", "mm", times, times)], version=version)
    np.testing.assert_array_equal(mdf.read(path, {"x": "defl"}).to_dict()["x"], times)


def test_invalid_samples_are_missing(tmp_path, monkeypatch):
    monkeypatch.setattr(mdf, "_READ", 2)
    times = np.arange(6) / 4
    invalid = np.array([False, True, False, False, False, True])
    path = write(tmp_path / "a.mf4", [("defl", "mm", times, times, invalid)])
    found = mdf.read(path, {"x": "defl"}).to_dict()
    np.testing.assert_array_equal(found["t"], times[~invalid])
    np.testing.assert_array_equal(found["x"], times[~invalid])


def test_an_invalid_sample_may_be_no_number(tmp_path):
    values, invalid = np.array([1, np.inf, 3.0]), np.array([False, True, False])
    path = write(tmp_path / "a.mf4", [("defl", "mm", np.arange(3.0), values, invalid)])
    assert list(mdf.read(path, {"x": "defl"}).to_dict()["x"]) == [1, 3]
    path = write(tmp_path / "b.mf4", [("defl", "mm", np.arange(3.0), values, ~invalid)])
    with pytest.raises(polyest.InvalidInput, match="defl: row 1 .*inf is not finite"):
        mdf.read(path, {"x": "defl"}).all()


@pytest.mark.parametrize(("unit", "length"), [
    ("", 1.0), ("s", 1.0), ("ms", 1e-3), ("msec", 1e-3), ("usec", 1e-6), ("hours", 3600.0)])
def test_times_are_in_the_unit_that_the_file_gives(tmp_path, unit, length):
    path = with_unit_of_time(tmp_path, unit)
    found = mdf.read(path, {"x": "defl"}).all().time_s
    np.testing.assert_allclose(found, np.array([100.0, 200.0]) * length, rtol=1e-15)


def test_an_unknown_unit_of_time_is_refused(tmp_path):
    path = with_unit_of_time(tmp_path, "ticks")
    with pytest.raises(polyest.InvalidInput, match="the time of 'defl': 'ticks' is no unit of ti"):
        mdf.read(path, {"x": "defl"}).all()


def with_unit_of_time(folder, unit):
    """Writes a file whose times 100 and 200 are in a unit."""
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.ones(2), np.array([100.0, 200.0]), name="defl")])
        file.groups[0].channels[file.masters_db[0]].unit = unit
        file.save(folder / "a.mf4", overwrite=True)
    return folder / "a.mf4"


def test_units_are_those_of_the_file_unless_others_are_given(tmp_path, client):
    times = np.arange(5) / 4
    path = write(tmp_path / "a.mf4", [("defl", "mm", times, times), ("w", "1/min", times, times)])
    assert mdf.read(path, {"x": "defl", "w": "w"}).units == {"x": "mm", "w": "rpm"}
    assert mdf.read(path, {"x": "defl"}, units={"x": "cm"}).units == {"x": "cm"}
    with pytest.raises(polyest.InvalidInput, match="no channel 'y'; there are 'x'"):
        mdf.read(path, {"x": "defl"}, units={"y": "cm"})
    with pytest.raises(polyest.InvalidInput, match="kg"):
        client.estimate(PROBLEM, mdf.read(path, {"x": "defl", "force": "w"},
                                          units={"x": "kg", "force": "N"}))


def test_times_begin_where_they_are_asked_to(tmp_path):
    times = 10 + np.arange(5) / 4
    path = write(tmp_path / "a.mf4", [("defl", "mm", times, times)])
    assert mdf.read(path, {"x": "defl"}).to_dict()["t"][0] == 10
    assert list(mdf.read(path, {"x": "defl"}, time_zero="first").to_dict()["t"]) == [
        0, 0.25, 0.5, 0.75, 1]
    with pytest.raises(polyest.InvalidInput, match="must be one of auto, file, first"):
        mdf.read(path, {"x": "defl"}, time_zero="last")


def test_a_name_that_does_not_exist_lists_the_nearest(ride):
    with pytest.raises(polyest.InvalidInput,
                       match=r"channels.x: there is no channel 'Defl'; the nearest are 'SUSP.defl'"):
        mdf.read(ride, {"x": "Defl"})


def test_channels_of_one_name_are_told_apart_by_their_groups(tmp_path):
    times = np.arange(4) / 4
    path = write(tmp_path / "a.mf4", [("defl", "mm", times, times)],
                 [("defl", "m", times, 2 * times)])
    with pytest.raises(polyest.InvalidInput, match=r"2 channels are named 'defl': "
                       r"Channel\('defl', group=0\) \(group 0\): 4 samples in mm; Channel"):
        mdf.read(path, {"x": "defl"})
    found = mdf.read(path, {"x": mdf.Channel("defl", group=1), "y": mdf.Channel("defl", group=0)})
    assert found.units == {"x": "m", "y": "mm"}
    np.testing.assert_array_equal(found.to_dict()["x"], 2 * times)
    np.testing.assert_array_equal(found.to_dict()["y"], times)
    with pytest.raises(polyest.InvalidInput, match="group 7 has no channel 'defl'; there are"):
        mdf.read(path, {"x": mdf.Channel("defl", group=7)})
    assert [(one.name, one.group, one.unit, one.samples) for one in mdf.channels(path)] == [
        ("defl", 0, "mm", 4), ("defl", 1, "m", 4)]


def test_channels_that_are_no_numbers_are_refused_by_name(tmp_path):
    times = np.arange(4) / 4
    curves = np.array([((1.0, 2.0, 3.0),)] * 4, dtype=[("curve", "f8", (3,))])
    path = write(tmp_path / "a.mf4", [("note", "", times, np.array([b"abc"] * 4))],
                 [("curve", "", times, curves)])
    with pytest.raises(polyest.InvalidInput, match="note: is no channel of numbers but of text"):
        mdf.read(path, {"x": "note"}).all()
    with pytest.raises(polyest.InvalidInput, match="curve: is no channel of numbers"):
        mdf.read(path, {"x": "curve"}).all()


def test_numbers_with_names_are_taken_when_they_are_asked_for(tmp_path):
    times = np.arange(4) / 4
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.array([0, 1, 1, 0], "u1"), times, name="gear",
                                    conversion={"val_0": 0, "text_0": b"off", "val_1": 1,
                                                "text_1": b"on"})])
        file.save(tmp_path / "a.mf4")
    with pytest.raises(polyest.InvalidInput, match=r"Channel\('gear', raw=True\) takes"):
        mdf.read(tmp_path / "a.mf4", {"x": "gear"}).all()
    found = mdf.read(tmp_path / "a.mf4", {"x": mdf.Channel("gear", raw=True)}).to_dict()
    assert list(found["x"]) == [0, 1, 1, 0]


def test_times_that_decrease_are_refused_and_equal_ones_counted(tmp_path, monkeypatch):
    path = write(tmp_path / "a.mf4", [("defl", "", np.array([0, 0.5, 0.25, 1]), np.ones(4))])
    for rows in (10, 2):
        monkeypatch.setattr(mdf, "_READ", rows)
        with pytest.raises(polyest.InvalidInput, match=r"decrease: 0.25 s follows 0.5 s"):
            mdf.read(path, {"x": "defl"}).all()
    path = write(tmp_path / "b.mf4", [("defl", "", np.array([0, 0.5, 0.5, 1]), np.arange(4.0))])
    for rows in (10, 2):
        monkeypatch.setattr(mdf, "_READ", rows)
        with pytest.warns(UserWarning, match="1 samples are not used"):
            found = mdf.read(path, {"x": "defl"}).to_dict()
        assert list(found["x"]) == [0, 1, 3]


@pytest.mark.parametrize(("content", "said"), [
    (b"t,x\n0,1\n", "is no MDF file"), (b"MDF     4.10    asammdf ", ""), (b"", "is no MDF file")])
def test_files_that_are_none_are_refused(tmp_path, content, said):
    (tmp_path / "bad.mf4").write_bytes(content)
    with pytest.raises(polyest.InvalidInput, match=said):
        mdf.read(tmp_path / "bad.mf4", {"x": "defl"})


def test_a_file_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(polyest.InvalidInput, match=r"none.mf4: cannot be opened: No such file"):
        mdf.read(tmp_path / "none.mf4", {"x": "defl"})


@pytest.mark.parametrize("channels", [{}, {"t": "time"}, ["x"]])
def test_channels_must_be_mapped(ride, channels):
    with pytest.raises(polyest.InvalidInput, match="channels"):
        mdf.read(ride, channels)


def test_without_the_extra_pip_s_command_is_named(monkeypatch, ride):
    monkeypatch.setitem(sys.modules, "asammdf", None)
    with pytest.raises(ImportError, match=r"pip install 'polyest\[mdf\]'"):
        mdf.read(ride, CHANNELS)
