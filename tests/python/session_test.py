"""Sessions: rows that come batch by batch, estimates as they come, a session found again."""

import contextlib
import os
import select
import subprocess
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pytest

import polyest
from conftest import TRUTH
from polyest._proto.v1 import estimate_pb2
from polyest._stream import MeasurementStream
from polyest.io import Batch, Recording
from polyest.results import history
from rig import wait_for


def test_batches_give_the_estimate_of_the_whole_record(client, problem, record, rows):
    with client.session("batches", problem) as session:
        for first in range(0, 1000, 125):
            assert session.append(rows(first, first + 125)) == first // 125 + 1
        found = session.estimate()
    assert found.sequence == 8 and found.samples == 1000
    assert found.to_dict()["parameters"] == client.estimate(problem, record).to_dict()["parameters"]


def test_batches_that_are_not_waited_for_are_kept_at_the_end(client, problem, rows):
    with client.session("pipelined", problem) as session:
        for first in range(0, 200, 5):
            session.append(rows(first, first + 5), wait=False)
    info = client.session("pipelined").info()
    assert (info.last_sequence, info.sample_count, info.has_writer) == (40, 200, False)


def test_the_status_tells_what_is_stored(client, problem, rows):
    before = client.status()
    with client.session("stored", problem) as session:
        session.append(rows(0, 100))
    # A row has a time and a sample.
    assert client.status().stored_bytes - before.stored_bytes > 100 * 16
    assert before.max_stored_bytes == 0


def test_long_data_are_cut_into_batches(client, problem, record):
    options = polyest.StreamOptions(batch_rows=300)
    with client.session("cut", problem, options=options) as session:
        assert session.append(record) == 4
        assert session.info().sample_count == 1000


def test_estimates_end_with_the_last_batch(client, problem, rows):
    with client.session("loop", problem) as session:
        session.append(rows(0, 200))
        session.append(rows(200, 400))
        found = list(session.estimates())
    assert found[-1].sequence == 2
    assert found[-1]["k"].lower95 < TRUTH["k"] < found[-1]["k"].upper95


def test_a_session_without_rows_has_no_estimates(client, problem):
    assert list(client.session("empty", problem).estimates()) == []


def test_an_observer_follows_a_writer(client, problem, rows):
    with client.session("followed", problem) as session:
        session.append(rows(0, 100))
        following = client.session("followed").estimates(follow=True)
        assert next(following).sequence == 1
        session.append(rows(100, 200))
        assert next(following).sequence == 2
        following.close()


def test_predictions_come_as_the_rows_do(client, problem, rows):
    with client.session("predicted", problem) as session:
        session.append(rows(0, 100))
        following = session.predictions(["x", "v"], draws=20, max_rows=50)
        found = next(following)
        following.close()
    assert list(found.outputs) == ["x", "v"] and found.sequence == 1
    assert found.draw_count == 20 and len(found.time_s) <= 50 and found.row_count == 100


def test_each_estimate_of_the_stream_is_told(client, problem, rows):
    told = []
    with client.session("told", problem, on_estimate=told.append) as session:
        for first in range(0, 300, 100):
            session.append(rows(first, first + 100))
    # A last one comes before the stream ends; a slow estimator may pass over others.
    numbers = [one.sequence for one in told]
    assert numbers[-1] == 3 and numbers == sorted(numbers)


def broken(estimate):
    raise ArithmeticError("of the program")


def test_an_exception_of_on_estimate_is_raised_by_a_later_call(client, problem, rows):
    session = client.session("raised", problem, on_estimate=broken)
    with pytest.raises(ArithmeticError, match="of the program"):
        session.append(rows(0, 20))
        wait_for(session.flush)  # which raises once the estimate has come
    with contextlib.suppress(ArithmeticError):  # of an estimate since
        session.append(rows(20, 40))
    with pytest.raises(ArithmeticError):
        session.close()  # after the last estimate
    session.close()
    assert session.info().sample_count == 40 and not session.info().has_writer


class Interrupted(MeasurementStream):
    """Tells an estimate, on a thread of its own, while `check` takes what has been raised."""

    telling = None

    @property
    def _raised(self):
        found = self.kept
        if self.telling is None:
            self.telling = threading.Thread(target=self._tell, args=(broken, None))
            self.telling.start()
            self.telling.join(0.2)  # it waits for `check`
        return found

    @_raised.setter
    def _raised(self, error):
        self.kept = error


def test_an_exception_that_on_estimate_raises_meanwhile_is_raised_by_the_next_call():
    stream = Interrupted(SimpleNamespace(left_streams={}), "sessions/any", polyest.StreamOptions())
    stream.check()
    stream.telling.join()
    with pytest.raises(ArithmeticError):
        stream.check()


def test_on_estimate_may_ask_the_session(client, problem, rows):
    asked = []

    def ask(estimate):
        asked.append((session.estimate().samples, session.predict(max_rows=10).row_count))
        for write in (lambda: session.append(rows(0, 10)), session.flush, session.close,
                      session.delete):
            with pytest.raises(polyest.FailedPrecondition, match="^on_estimate must not write"):
                write()

    with client.session("asked", problem, on_estimate=ask) as session:
        for first in range(0, 200, 20):
            session.append(rows(first, first + 20))
    assert asked[-1] == (200, 200)


def test_a_session_goes_on_where_it_was_left(client, problem, rows):
    with client.session("again", problem) as session:
        session.append(rows(0, 100))
    with client.session("again", problem) as session:
        assert session.append(rows(100, 200)) == 2
    with client.session("again") as session:
        assert session.append(rows(200, 300)) == 3
        assert session.estimate().samples == 300
        assert session.problem == problem


def test_a_problem_with_the_address_of_its_schema_finds_its_session(client, problem, rows):
    wanted = {"$schema": "problem.schema.json", **problem.as_dict()}
    for first in (0, 100):
        with client.session("with-schema", wanted) as session:
            session.append(rows(first, first + 100))
    assert client.session("with-schema", problem).info().sample_count == 200


def test_a_history_shows_how_the_estimate_came_about(client, problem, rows):
    with client.session("history", problem) as session:
        for first in range(0, 400, 100):
            session.append(rows(first, first + 100))
            session.estimate()
        history = session.history()
    assert [point.sequence for point in history.points] == [1, 2, 3, 4]
    widths = [point.parameters["k"].std_dev for point in history.points]
    assert widths[-1] < widths[0]
    assert history.points[-1].reexpansion_count >= history.points[0].reexpansion_count > 0
    frame = history.to_dataframe()
    assert list(frame.columns)[:4] == ["t", "samples", "sequence", "name"] and len(frame) == 8


def test_a_history_of_a_newer_daemon_keeps_what_it_cannot_name():
    message = estimate_pb2.EstimateHistory()
    message.points.add(warnings=[estimate_pb2.Diagnostic.MODEL_MISFIT, 9999])
    assert history.of_message(message).points[0].warnings == ["MODEL_MISFIT", "9999"]


def test_an_exception_leaves_the_session_to_the_next_writer(client, problem, rows):
    with pytest.raises(RuntimeError), client.session("broken-off", problem) as session:
        session.append(rows(0, 100))
        raise RuntimeError("the rig stopped")
    with client.session("broken-off") as session:
        assert session.append(rows(100, 200)) == 2


def test_a_session_that_is_dropped_is_left_to_the_next_writer(client, problem, rows):
    told = []
    session = client.session("dropped", problem, on_estimate=told.append)
    for first in range(0, 100, 10):
        session.append(rows(first, first + 10), wait=False)
    del session
    assert client.session("dropped").append(rows(100, 200)) == 11
    with polyest.connect(client.server) as other:
        wait_for(lambda: not client.session("dropped").info().has_writer)
        assert other.session("dropped").append(rows(200, 300)) == 12


def test_estimates_that_are_kept_do_not_keep_a_dropped_session(client, problem, rows):
    told = []
    session = client.session("kept-estimates", problem, on_estimate=told.append)
    session.append(rows(0, 100))
    asked = session.estimate()
    wait_for(lambda: told)
    del session
    assert client.session("kept-estimates").append(rows(100, 200)) == 2
    assert [one._studies().history().points[0].sequence for one in (asked, told[0])] == [1, 1]


def test_rows_that_are_refused_are_named_and_the_session_goes_on(client, problem, rows):
    with client.session("refused", problem) as session:
        session.append(rows(0, 100))
        with pytest.raises(polyest.InvalidInput, match="time"):
            session.append(rows(0, 100))
        assert session.append(rows(100, 200)) == 2
        assert session.estimate().samples == 200


def test_rows_that_are_refused_do_not_begin_the_time(client, problem, rows):
    dates = np.datetime64("2026-01-31T13:00:00") + np.arange(100) * np.timedelta64(50, "ms")
    good = {"t": dates, "x": rows(0, 100)["x"]}
    early = {**good, "t": dates - np.timedelta64(1, "h")}
    with client.session("dated", problem) as session:
        for bad in ({**early, "x": ["fast"] * 100}, {**early, "x": np.full(100, 1e200)}):
            with pytest.raises(polyest.InvalidInput):
                session.append(bad)
        session.append(good)
        assert session.info().last_time_s == 99 * 0.05
        session.close()
        session.append({**good, "t": dates + np.timedelta64(5, "s")})
        assert session.info().last_time_s == 199 * 0.05


def test_no_rows_are_refused_alone(client, problem, rows):
    with client.session("no-rows", problem) as session:
        for first in range(0, 90, 10):
            session.append(rows(first, first + 10), wait=False)
            with pytest.raises(polyest.InvalidInput, match="there are no rows"):
                session.append(rows(0, 0), wait=False)
        session.append(rows(0, 0), end_of_run=True)
    assert session.info().sample_count == 90


@pytest.mark.parametrize(("bad", "said"), [
    (1e90, r"row 615 \(counted from 0\), column x: 1e\+90 is more than"),
    (np.inf, r"measurements.channels\[0\].values\[615\]: inf of x must be finite"),
])
def test_a_refused_row_is_named_as_the_data_count_it(client, problem, record, bad, said):
    name = f"counted-{'big' if bad < np.inf else 'inf'}"
    options = polyest.StreamOptions(batch_rows=100)
    values = np.where(np.arange(1000) == 615, bad, record["x"])
    parts = [Batch(record["t"][at:at + 150], {"x": values[at:at + 150]})
             for at in range(0, 1000, 150)]
    with client.session(name, problem, options=options) as session:
        with pytest.raises(polyest.InvalidInput, match=f"^{said}") as raised:
            session.append(Recording("file", {"x": ""}, lambda: iter(parts)))
        assert session.info().sample_count == 600  # up to the batch of the row
    assert raised.value.field == "measurements.channels[0].values[615]"


def test_streamed_inputs_need_the_end_of_the_run(client):
    wanted = (polyest.Problem.builtin("mass_spring_damper").fix(m=1.0)
              .uncertain("k", polyest.Uniform(30, 50)).stream("force").measure("x", 0.01))
    times = np.arange(0.0, 4.0, 0.05)
    # From rest at 0 the force 0 holds it there.
    data = {"t": times, "x": 0 * times, "force": 0 * times}
    with client.session("streamed", wanted) as session:
        session.append(data)
        before = session.estimate().samples
        session.end_run()
        assert before < session.estimate().samples == len(times)


def test_sessions_are_listed_and_deleted(client, problem):
    for name in ("listed-b", "listed-a"):
        client.session(name, problem)
    names = [one.name for one in client.sessions()]
    assert names == sorted(names) and {"listed-a", "listed-b"} <= set(names)
    client.delete_session("listed-a")
    client.session("listed-b").delete()
    assert not {"listed-a", "listed-b"} & {one.name for one in client.sessions()}


def lives(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_local_daemon_ends_with_its_client():
    with polyest.local() as client:
        pid = client.daemon.pid
        assert client.status().durable is False and lives(pid)
    assert not lives(pid)
    with pytest.raises(polyest.FailedPrecondition, match="the client is closed"):
        client.status()


def test_who_reads_the_log_of_a_local_daemon_does_not_move_where_it_writes():
    with polyest.local() as client:
        log = client.daemon._log.fileno()
        os.lseek(log, 3, os.SEEK_SET)  # as if the daemon were in the middle of its log
        assert "ready" in client.daemon.log()
        assert os.lseek(log, 0, os.SEEK_CUR) == 3


@pytest.mark.parametrize("end", ["sys.exit(3)", "os.kill(os.getpid(), signal.SIGKILL)"])
def test_a_local_daemon_ends_with_its_program(end, tmp_path):
    program = ("import os, signal, sys, polyest\n"
               f"client = polyest.local(data_dir={str(tmp_path)!r})\n"
               f"session = client.status()\nprint(client.daemon.pid, flush=True)\n{end}")
    done = subprocess.run([sys.executable, "-c", program], stdout=subprocess.PIPE, check=False)
    pid = int(done.stdout)
    try:
        descriptor = os.pidfd_open(pid)
    except ProcessLookupError:
        return
    ended, _, _ = select.select([descriptor], [], [], 30)
    os.close(descriptor)
    assert ended


def test_dates_do_not_go_on_a_run_that_counts_from_another_row(client, problem):
    def dates(second, count):
        begin = np.datetime64("2026-01-31T10:00:00") + np.timedelta64(second, "s")
        return {"t": begin + np.arange(count) * np.timedelta64(1, "s"), "x": np.ones(count)}

    with client.session("by-date", problem) as session:
        session.append(dates(0, 3))
        session.append(dates(3, 3))
    with client.session("by-date") as session:
        with pytest.raises(polyest.InvalidInput, match=r"t: dates count from the first row .*t = 5 s "
                           r"of run 0 already; .* the next run, 1"):
            session.append(dates(6, 20))
        session.append({**dates(6, 20), "run": np.ones(20, dtype=int)})
        assert session.info().sample_count == 26
