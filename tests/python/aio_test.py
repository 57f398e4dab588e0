"""The package for asyncio: the same results, many sessions at once, a daemon that is restarted."""

import asyncio
import contextlib

import pytest

import polyest
from polyest import aio
from polyest.aio.session import Session
from polyest.aio.stream import MeasurementStream

FAST = polyest.StreamOptions(first_delay_s=0.01, max_delay_s=0.1, max_attempts=1000)


def test_one_shot_and_studies_are_those_of_the_synchronous_client(client, problem, record):
    async def run():
        async with aio.connect(client.server) as other:
            experiment = other.experiment(problem, record)
            prediction = await experiment.predict(draws=50)
            posterior = await experiment.posterior(samples=10)
            profiles = await experiment.profiles(["k"], points=5)
            check = await other.check(problem, record)
            models = await other.models()
            return (await other.estimate(problem, record), prediction, posterior, profiles, check,
                    models)

    estimate, prediction, posterior, profiles, check, models = asyncio.run(run())
    same = client.experiment(problem, record)
    assert estimate.to_dict() == same.estimate().to_dict()
    assert prediction["x"].mean.tolist() == same.predict(draws=50)["x"].mean.tolist()
    assert posterior.samples.shape == (10, 2) and list(profiles.profiles) == ["k"]
    assert check.ok and "duffing" in models
    with pytest.raises(ValueError, match="does not know its measurements"):
        estimate.plot_fit()


def test_a_hundred_sessions_at_once(client, rows):
    problem = (polyest.Problem.builtin("mass_spring_damper").fix(m=1.0, x0=1.0, c=0.23)
               .uncertain("k", polyest.Normal(41.0, 0.5)).measure("x", noise=0.01))
    options = polyest.StreamOptions(estimate_every=None)

    async def write(other, number):
        async with await other.session(f"many-{number}", problem, options=options) as session:
            for first in range(0, 40, 10):
                await session.append(rows(number + first, number + first + 10))
            return await session.estimate()

    async def run():
        async with aio.connect(client.server) as other:
            estimates = await asyncio.gather(*(write(other, number) for number in range(100)))
            named = [one.name for one in await other.sessions()]
            return estimates, named

    estimates, named = asyncio.run(run())
    assert [one.samples for one in estimates] == [40] * 100
    assert [one.sequence for one in estimates] == [4] * 100
    assert {f"many-{number}" for number in range(100)} <= set(named)
    for number in (0, 99):
        alone = client.estimate(problem, rows(number, number + 40)).to_dict()
        assert estimates[number].to_dict()["parameters"] == alone["parameters"]


def test_tasks_may_share_a_session(client, problem, rows):
    async def run():
        async with aio.connect(client.server) as other:
            async with await other.session("shared", problem) as session:
                await asyncio.gather(*(session.append(rows(10 * one, 10 * one + 10))
                                       for one in range(10)))
                return await session.info()

    assert asyncio.run(run()).sample_count == 100


def test_a_daemon_killed_under_append_loses_nothing(restartable, client, problem, record, rows):
    async def run():
        daemon = restartable()
        async with aio.connect(daemon.address) as other:
            async with await other.session("run7", problem, options=FAST) as session:
                for kill in range(3):
                    for first in range(100 * kill, 100 * kill + 100, 4):
                        await session.append(rows(first, first + 4), wait=False)
                    daemon.kill()
                    daemon = await asyncio.get_running_loop().run_in_executor(None, restartable)
                await session.append(rows(300, 1000))
                return await session.info(), await session.estimate()

    info, estimate = asyncio.run(run())
    assert (info.last_sequence, info.sample_count) == (76, 1000)
    expected = client.estimate(problem, record).to_dict()
    assert estimate.to_dict()["parameters"] == expected["parameters"]


def test_estimates_come_and_are_followed(client, problem, rows):
    told = []

    async def run():
        async with aio.connect(client.server) as other:
            session = await other.session("followed-aio", problem, on_estimate=told.append)
            async with session:
                await session.append(rows(0, 100))
                following = (await other.session("followed-aio")).estimates(follow=True)
                first = await following.__anext__()
                await session.append(rows(100, 200))
                second = await following.__anext__()
                await following.aclose()
                async for predicted in session.predictions(draws=20):
                    assert predicted.row_count == 200
                    break
                ended = [one.sequence async for one in session.estimates()]
                return first.sequence, second.sequence, ended[-1], len(await session.history())

    first, second, last, kept = asyncio.run(run())
    assert (first, second, last) == (1, 2, 2) and kept >= 1
    assert told[-1].sequence == 2


def test_an_exception_of_on_estimate_is_raised_by_a_later_call(client, problem, rows):
    def broken(estimate):
        raise ArithmeticError("of the program")

    async def run():
        async with aio.connect(client.server) as other:
            session = await other.session("raised-aio", problem, on_estimate=broken)
            with pytest.raises(ArithmeticError, match="of the program"):
                await session.append(rows(0, 2))
                while True:  # until the estimate has come
                    await session.flush()
                    await asyncio.sleep(0.01)
            with contextlib.suppress(ArithmeticError):  # of an estimate since
                await session.append(rows(2, 4))
            with pytest.raises(ArithmeticError):
                await session.close()  # after the last estimate
            await session.close()
            return (await session.info()).sample_count

    assert asyncio.run(run()) == 4


def test_a_session_that_is_dropped_is_left_to_the_next_writer(client, problem, rows):
    async def run():
        async with aio.connect(client.server) as other:
            session = await other.session("dropped-aio", problem)
            for first in range(0, 100, 10):
                await session.append(rows(first, first + 10), wait=False)
            del session
            await (await other.session("dropped-aio")).append(rows(100, 200))
            while (await (await other.session("dropped-aio")).info()).has_writer:
                await asyncio.sleep(0.01)

    asyncio.run(run())
    assert client.session("dropped-aio").append(rows(200, 300)) == 12


def test_sessions_are_exported_imported_and_deleted(client, problem, rows, tmp_path):
    async def run():
        async with aio.connect(client.server) as other:
            async with await other.session("moved", problem) as session:
                await session.append(rows(0, 100))
                await session.export(tmp_path / "moved.polyest")
                before = await session.estimate()
            await session.delete()
            again = await other.import_session(tmp_path / "moved.polyest")
            after = await again.estimate()
            await other.delete_session("moved")
            with pytest.raises(polyest.NotFound):
                await other.session("moved")
            return before, after

    before, after = asyncio.run(run())
    assert before.to_dict() == after.to_dict()


def test_refusals_are_the_same_exceptions(client, problem, rows):
    async def run():
        async with aio.connect(client.server) as other:
            async with await other.session("refused-aio", problem) as session:
                await session.append(rows(0, 10))
                with pytest.raises(polyest.InvalidInput, match="time"):
                    await session.append(rows(0, 10))
                await session.append(rows(10, 20))
                # gRPC may hide the reason: then it is found after a few attempts.
                few = polyest.StreamOptions(first_delay_s=0.01, max_attempts=3)
                second = await other.session("refused-aio", options=few)
                with pytest.raises(polyest.Aborted):
                    await second.append(rows(20, 30))
            with pytest.raises(polyest.InvalidInput, match="no quantity 'X'"):
                await other.session("units-aio", problem, units={"X": "mm"})
            with pytest.raises(polyest.NotFound):
                await other.session("units-aio")
            with pytest.raises(polyest.InvalidInput, match="the column 'force' for the streamed"):
                await other.estimate(problem.copy().stream("force"), rows(0, 10))
            with pytest.raises(polyest.NotFound):
                await other.model("perpetual_motion")
            raise RuntimeError("the rig stopped")

    with pytest.raises(RuntimeError):
        asyncio.run(run())


def test_a_reason_that_grpc_hides_is_found(client, problem, rows):
    def stream_of(session, first, last):
        stream = MeasurementStream(session._transport, "sessions/hidden", FAST)
        stream.reason_is_hidden = True
        stream.queue.add(session._converter.convert(rows(first, last)))
        return stream

    async def run():
        async with aio.connect(client.server) as other:
            session = await other.session("hidden", problem)
            good = stream_of(session, 0, 10)
            await good.flush()
            # The daemon says that another stream writes, or refuses the rows that it has.
            with pytest.raises((polyest.Aborted, polyest.InvalidInput)):
                bad = stream_of(session, 0, 10)
                bad.queue.options = polyest.StreamOptions(max_attempts=0)
                await bad.flush()
            await good.finish()
            with pytest.raises(polyest.InvalidInput, match="time"):
                await stream_of(session, 0, 10).flush()
            return (await session.info()).sample_count

    assert asyncio.run(run()) == 10


def test_a_local_daemon_ends_with_its_client(problem):
    async def run():
        async with aio.local() as client:
            assert (await client.status()).version
            return client.daemon

    daemon = asyncio.run(run())
    assert daemon._shell.poll() is not None


def test_there_is_what_the_synchronous_clients_have(client):
    for one, other in ((polyest.Client, aio.Client), (polyest.Session, Session)):
        missing = [name for name in dir(one) if not name.startswith("_") and not hasattr(other, name)]
        assert missing == []

    async def schema():
        async with aio.connect(client.server) as other:
            return await other.problem_schema()

    assert asyncio.run(schema()) == client.problem_schema()
