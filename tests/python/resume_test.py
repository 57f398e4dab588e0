"""Connections that break: the daemon is killed and restarted while rows are appended."""

import asyncio
import contextlib
from concurrent import futures

import pytest

import polyest
from polyest import aio
from polyest._proto.v1 import measurements_pb2
from polyest._resume import BatchQueue, StreamOptions
from rig import wait_for

FAST = polyest.StreamOptions(first_delay_s=0.01, max_delay_s=0.1, max_attempts=1000)
FEW = polyest.StreamOptions(first_delay_s=0.01, max_delay_s=0.01, max_attempts=2)


def test_a_daemon_killed_under_append_loses_nothing_and_counts_nothing_twice(
        restartable, client, problem, record, rows):
    daemon = restartable()
    session = polyest.connect(daemon.address).session("run7", problem, options=FAST)
    with session, futures.ThreadPoolExecutor(1) as executor:
        for kill in range(4):
            for first in range(200 * kill, 200 * kill + 200, 4):
                if first == 200 * kill + 100:
                    daemon.kill()
                    starting = executor.submit(restartable)
                session.append(rows(first, first + 4), wait=False)
            daemon = starting.result()
        session.append(rows(800, 1000))
        assert session.info().last_sequence == 201
        assert session.info().sample_count == 1000
        found = session.estimate()
    expected = client.estimate(problem, record)
    assert found.to_dict()["parameters"] == expected.to_dict()["parameters"]


def test_a_long_queue_survives_restarts(restartable, problem, record):
    daemon = restartable()
    options = polyest.StreamOptions(batch_rows=1, first_delay_s=0.01, max_attempts=1000)
    session = polyest.connect(daemon.address).session("queue", problem, options=options)
    with session, futures.ThreadPoolExecutor(1) as executor:
        appending = executor.submit(session.append, record)
        for kept in (100, 400, 700):
            with polyest.connect(daemon.address) as other:
                wait_for(lambda kept=kept: other.session("queue").info().last_sequence >= kept)
            daemon.kill()
            daemon = restartable()
        assert appending.result() == 1000
        assert session.info().sample_count == 1000


def test_append_itself_survives_a_restart(restartable, problem, rows):
    daemon = restartable()
    with polyest.connect(daemon.address).session("kept", problem, options=FAST) as session:
        for batch in range(5):
            assert session.append(rows(10 * batch, 10 * batch + 10)) == batch + 1
            daemon.kill()
            daemon = restartable()
        assert session.estimate().samples == 50


def test_the_end_of_the_stream_survives_a_restart(restartable, problem, rows):
    daemon = restartable()
    with polyest.connect(daemon.address).session("ended", problem, options=FAST) as session:
        session.append(rows(0, 100), wait=False)
        daemon.kill()
        restartable()
    assert session.info().sample_count == 100


def test_rows_stay_pending_while_the_daemon_is_away(restartable, problem, rows):
    daemon = restartable()
    session = polyest.connect(daemon.address).session("away", problem, options=FEW)
    session.append(rows(0, 10))
    daemon.kill()
    with pytest.raises(polyest.Unavailable) as raised:
        session.append(rows(10, 20))
    assert raised.value.retry
    restartable()
    session.flush()
    assert session.append(rows(20, 30)) == 3
    session.close()
    assert session.info().sample_count == 30


def test_rows_stay_pending_after_an_end_without_the_daemon(restartable, problem, rows):
    daemon = restartable()
    session = polyest.connect(daemon.address).session("ended", problem, options=FEW)
    session.append(rows(0, 10))
    daemon.kill()
    for end in (lambda: session.append(rows(10, 20)), session.close, session.close):
        with pytest.raises(polyest.Unavailable):
            end()
    restartable()
    session.flush()
    assert session.append(rows(20, 30)) == 3
    session.close()
    assert session.info().sample_count == 30 and not session.info().has_writer


def test_rows_of_a_task_stay_pending_after_an_end_without_the_daemon(restartable, problem, rows):
    async def run():
        daemon = restartable()
        async with aio.connect(daemon.address) as client:
            session = await client.session("ended", problem, options=FEW)
            await session.append(rows(0, 10))
            daemon.kill()
            for end in (lambda: session.append(rows(10, 20)), session.close, session.close):
                with pytest.raises(polyest.Unavailable):
                    await end()
            restartable()
            while True:
                with contextlib.suppress(polyest.Unavailable):
                    await session.close()
                    return await session.info()

    assert asyncio.run(run()).sample_count == 20


def test_a_daemon_that_forgets_is_a_loss_of_data(restartable, problem, rows):
    daemon = restartable(durable=False)
    session = polyest.connect(daemon.address).session("lost", problem, options=FAST)
    session.append(rows(0, 10))
    daemon.kill()
    restartable(durable=False)
    with pytest.raises(polyest.DataLoss, match="has lost sessions/lost and the batches it had "
                       "acknowledged, up to number 1"):
        session.append(rows(10, 20))


def test_a_second_writer_is_aborted(client, problem, rows):
    with client.session("twice", problem) as first:
        first.append(rows(0, 10))
        second = client.session("twice")
        with pytest.raises(polyest.Aborted, match="writer"):
            second.append(rows(10, 20))
        assert first.append(rows(10, 20)) == 2


def test_batches_of_another_client_are_not_taken_for_the_own_ones(restartable, problem, rows):
    daemon = restartable()
    session = polyest.connect(daemon.address).session("shared", problem, options=FEW)
    session.append(rows(0, 40))
    daemon.kill()
    for first in (40, 60):
        with pytest.raises(polyest.Unavailable):
            session.append(rows(first, first + 20))
    write_other_batches(restartable().address, rows)
    with pytest.raises(polyest.Aborted, match="another client writes to sessions/shared: .*2 was "
                       r"taken with other measurements.*\(2 batches were not kept\)"):
        session.flush()
    assert session.info().sample_count == 50
    assert session.append(rows(50, 60)) == 4


def test_batches_of_another_client_are_not_taken_for_those_of_a_task(restartable, problem, rows):
    async def run():
        daemon = restartable()
        async with aio.connect(daemon.address) as client:
            session = await client.session("shared", problem, options=FEW)
            await session.append(rows(0, 40))
            daemon.kill()
            for first in (40, 60):
                with pytest.raises(polyest.Unavailable):
                    await session.append(rows(first, first + 20))
            write_other_batches(restartable().address, rows)
            with pytest.raises(polyest.Aborted, match="2 was taken with other measurements"):
                while True:
                    with contextlib.suppress(polyest.Unavailable):
                        await session.flush()
                        return

    asyncio.run(run())


def write_other_batches(server, rows):
    with polyest.connect(server) as other, other.session("shared") as session:
        session.append(rows(40, 45))
        session.append(rows(45, 50))


def queue_with(batches, **options):
    queue = BatchQueue("sessions/any", StreamOptions(**options))
    queue.connected(10)
    for _ in range(batches):
        queue.add(measurements_pb2.Measurements())
    return queue


def written(queue):
    return [request.sequence for request in iter(queue.next_to_write, None)]


def test_batches_are_numbered_from_the_sessions_last_one():
    queue = queue_with(3)
    assert written(queue) == [11, 12, 13]
    queue.acknowledge(12)
    assert len(queue) == 1 and written(queue) == []


def test_a_new_connection_sends_all_that_was_not_acknowledged():
    queue = queue_with(4)
    assert written(queue) == [11, 12, 13, 14]
    queue.acknowledge(11)
    queue.connected(13)  # 12 and 13 may be another client's
    assert written(queue) == [12, 13, 14]


def test_a_session_with_other_batches_has_another_writer():
    with pytest.raises(polyest.Aborted, match="has batch 13, the last one sent is 12"):
        queue_with(2).connected(13)


def test_a_session_that_lacks_acknowledged_batches_has_lost_them():
    queue = queue_with(2)
    queue.acknowledge(12)
    with pytest.raises(polyest.DataLoss, match="up to 11, but acknowledged them up to 12"):
        queue.connected(11)


def test_delays_double_up_to_the_longest_and_end_with_the_attempts():
    queue = queue_with(0, first_delay_s=1.0, max_delay_s=5.0, max_attempts=4)
    broken = polyest.Unavailable("gone")
    delays = [queue.delay_s(broken, new_token=False) for _ in range(5)]
    assert delays == [1.0, 2.0, 4.0, 5.0, None]
    queue.acknowledge(10)
    assert queue.delay_s(broken, new_token=False) == 1.0


def test_a_full_disk_is_waited_for_without_end():
    queue = queue_with(0, first_delay_s=1.0, max_delay_s=2.0, max_attempts=0)
    full = polyest.ResourceExhausted("full", reason="DISK_FULL", retry_after_s=3.0)
    assert [queue.delay_s(full, new_token=False) for _ in range(3)] == [3.0, 3.0, 3.0]
    too_large = polyest.ResourceExhausted("too large", limit="--max-batch-rows")
    assert queue.delay_s(too_large, new_token=False) is None


def test_a_new_token_is_tried_and_a_wrong_one_is_not():
    queue = queue_with(0)
    refused = polyest.Unauthenticated("unknown token")
    assert queue.delay_s(refused, new_token=False) is None
    assert queue.delay_s(refused, new_token=True) is not None


def test_a_session_with_other_batches_is_not_waited_for():
    queue = queue_with(1)
    assert queue.delay_s(polyest.Unavailable("gone"), new_token=False) is not None
    with pytest.raises(polyest.Aborted) as raised:
        queue.connected(12)
    assert queue.delay_s(raised.value, new_token=False) is None


def test_a_session_that_another_writer_took_over_during_a_break_is_not_waited_for(
        restartable, problem, rows):
    daemon = restartable()
    patient = polyest.StreamOptions(first_delay_s=0.05, max_delay_s=3600)
    session = polyest.connect(daemon.address).session("taken", problem, options=patient)
    session.append(rows(0, 10))
    daemon.kill()
    other = polyest.connect(restartable().address).session("taken")
    other.append(rows(10, 20))
    with pytest.raises(polyest.Aborted) as raised:
        session.append(rows(10, 20))
    assert raised.value.reason == "ANOTHER_WRITER"
    assert other.append(rows(20, 30)) == 3


def test_another_writer_is_not_waited_for_after_a_break():
    queue = queue_with(0)
    assert queue.delay_s(polyest.Unavailable("gone"), new_token=False) is not None
    aborted = polyest.Aborted("another writer", reason="ANOTHER_WRITER")
    assert queue.delay_s(aborted, new_token=False) is None


def test_a_writer_without_a_name_is_waited_for_only_after_a_break():
    queue = queue_with(0)
    aborted = polyest.Aborted("another writer")
    assert queue.delay_s(aborted, new_token=False) is None
    assert queue.delay_s(polyest.Unavailable("gone"), new_token=False) is not None
    assert queue.delay_s(aborted, new_token=False) is not None
