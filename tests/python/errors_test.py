"""Every exception, with what it tells: by the daemon where it can be brought to it."""

import asyncio
import threading
from concurrent import futures

import grpc
import pytest
from google.protobuf import any_pb2

import polyest
from polyest import _daemon
from polyest._proto.rpc import error_details_pb2
from polyest._proto.v1 import problem_service_pb2

CODES = [code for code in grpc.StatusCode if code is not grpc.StatusCode.OK]


def test_a_wrong_field_is_named_with_its_rule(client, problem, record):
    wrong = problem.copy().uncertain("x0", polyest.Uniform(2.0, 1.0))
    with pytest.raises(polyest.InvalidInput) as raised:
        client.estimate(wrong, record)
    error = raised.value
    assert error.field.startswith("uncertain[2].uniform")
    assert error.rule and error.rule in error.message
    assert not error.retry and isinstance(error, ValueError)


def test_a_name_that_the_model_lacks_is_refused_with_those_it_has(client, record):
    wrong = polyest.Problem.builtin("mass_spring_damper").uncertain(
        "stiffness", polyest.Uniform(1, 2)).measure("x", 0.01)
    with pytest.raises(polyest.InvalidInput, match="stiffness.*k"):
        client.estimate(wrong, record)


def test_a_field_that_no_problem_has_is_refused_before_it_is_sent(client, record):
    with pytest.raises(polyest.InvalidInput, match="uncertian") as raised:
        client.estimate({"model": {"builtin": "duffing"}, "uncertian": []}, record)
    assert raised.value.code == "INVALID_ARGUMENT"


def test_data_that_lack_a_streamed_input_are_refused_before_they_are_sent(client, problem, rows):
    driven = problem.copy().stream("force")
    missing = "the column 'force' for the streamed input of that name is missing"
    experiment = client.experiment(driven, {**rows(0, 10), "force": rows(0, 10)["x"]})
    for found in (client.check(driven, rows(0, 10)), driven.check(rows(0, 10), client=client)):
        assert [missing in one.description for one in found.errors] == [True]
    for call in (lambda: client.estimate(driven, rows(0, 10)),
                 lambda: experiment.predict(record=rows(10, 20))):
        with pytest.raises(polyest.InvalidInput, match=missing):
            call()
    with client.session("without-input", driven) as session:
        with pytest.raises(polyest.InvalidInput, match=missing):
            session.append(rows(0, 10))
        assert session.info().last_sequence == 0


def test_units_of_unknown_names_are_refused_before_anything_is_sent(client, problem, record):
    for call in (client.estimate, client.check, client.experiment):
        with pytest.raises(polyest.InvalidInput, match="no quantity 'X'.*the nearest is 'x'"):
            call(problem, record, units={"X": "mm"})
    with pytest.raises(polyest.InvalidInput, match="no quantity 'X'"):
        client.session("wrong-units", problem, units={"X": "mm"})
    with pytest.raises(polyest.NotFound):
        client.session("wrong-units")


def test_a_number_in_place_of_a_file_is_not_opened(client, record, tmp_path):
    # `open` would close what has the number, such as the client's own connection.
    with open(tmp_path / "other", "w+") as other:
        with pytest.raises(TypeError, match="a problem must be"):
            client.estimate(other.fileno(), record)
        with pytest.raises(TypeError):
            client.import_session(other.fileno())
        other.write("still open")


def test_a_problem_file_that_cannot_be_read_is_named(client, record, tmp_path):
    with pytest.raises(polyest.InvalidInput, match="none.json: cannot be opened"):
        client.estimate(tmp_path / "none.json", record)
    (tmp_path / "list.json").write_text("[]")
    with pytest.raises(polyest.InvalidInput, match="must hold one JSON object"):
        client.estimate(tmp_path / "list.json", record)


def test_a_session_that_does_not_exist(client):
    with pytest.raises(polyest.NotFound, match="nowhere"):
        client.session("nowhere")


def test_a_session_that_has_another_problem(client, problem):
    client.session("taken", problem)
    with pytest.raises(polyest.AlreadyExists, match="'taken' exists with another problem"):
        client.session("taken", problem.copy().fix(m=2.0))


def test_a_model_that_cannot_be_integrated(client):
    # dx/dt = k x² from 1 is infinite at 1/k, long before the last sample.
    escaping = (polyest.Problem.equations(states={"x": "k*x^2"}, outputs={"x": "x"})
                .fix(x_0=1.0).uncertain("k", polyest.Uniform(5, 6)).measure("x", 0.1))
    with pytest.raises(polyest.FailedPrecondition):
        client.estimate(escaping, {"t": [10.0, 20.0], "x": [1.0, 1.0]})


def test_a_limit_that_is_passed_is_named(problem):
    with polyest.local(arguments=["--max-sessions", "1"]) as client:
        client.session("first", problem)
        with pytest.raises(polyest.ResourceExhausted) as raised:
            client.session("second", problem)
    assert raised.value.limit == "--max-sessions"
    assert raised.value.reason == "LIMIT_EXCEEDED"
    assert not raised.value.retry


def test_a_call_that_takes_too_long(client, problem, record):
    with polyest.connect(client.server, timeout_s=1e-6) as hasty:
        with pytest.raises(polyest.DeadlineExceeded) as raised:
            hasty.estimate(problem, record)
    assert isinstance(raised.value, TimeoutError)


def test_a_watch_that_is_closed_with_its_client(client, problem, rows):
    with client.session("closed", problem) as session:
        session.append(rows(0, 100))
    observer = polyest.connect(client.server)
    following = observer.session("closed").estimates(follow=True)
    next(following)
    observer.close()
    with pytest.raises(polyest.Cancelled):
        next(following)


def test_a_client_that_is_closed_says_so(client, problem, rows, tmp_path):
    other = polyest.connect(client.server)
    session = other.session("closed-client", problem)
    session.append(rows(0, 10))
    session.export(tmp_path / "file")
    other.close()
    for call in (other.status, lambda: list(session.estimates()), session.close,
                 lambda: other.import_session(tmp_path / "file"),
                 lambda: session.append(rows(10, 20)), session.info):
        with pytest.raises(polyest.FailedPrecondition, match="the client is closed"):
            call()

    async def asynchronous():
        other = polyest.aio.connect(client.server)
        session = await other.session("closed-client")
        await other.close()
        for call in (other.status, session.info, lambda: session.append(rows(10, 20)),
                     lambda: other.import_session(tmp_path / "file"),
                     lambda: session.estimates(follow=True).__anext__()):
            with pytest.raises(polyest.FailedPrecondition, match="the client is closed"):
                await call()

    asyncio.run(asynchronous())


def test_a_session_that_is_deleted_ends_its_watches(client, problem, rows):
    with client.session("deleted", problem) as session:
        session.append(rows(0, 100))
        following = session.estimates(follow=True)
        next(following)
        client.delete_session("deleted")
        with pytest.raises(polyest.NotFound):
            next(following)
        session._stream.cancel()
        session._stream = None


def test_a_daemon_that_is_not_there():
    daemon = _daemon.start()
    daemon.stop()
    with polyest.connect(daemon.address) as client:
        with pytest.raises(polyest.Unavailable, match=daemon.address.rpartition(":")[2]) as raised:
            client.status()
    assert raised.value.retry and isinstance(raised.value, ConnectionError)


def test_a_program_that_is_no_daemon():
    with pytest.raises(polyest.Unavailable, match="is no program"):
        polyest.local("/nowhere/polyestd")
    with pytest.raises(polyest.Unavailable, match="did not start: .*--max-sessions"):
        polyest.local(arguments=["--max-sessions", "0"])


@pytest.fixture
def guarded(tmp_path):
    """A daemon with tokens, and the token of a reader."""
    import subprocess

    made = subprocess.run([_daemon.find_program(None), "--new-token", "eye:lab:reader"],
                          capture_output=True, text=True, check=True)
    (tmp_path / "tokens").write_text(made.stderr)
    (tmp_path / "reader.token").write_text(made.stdout)
    with polyest.local(arguments=["--tokens", str(tmp_path / "tokens")]) as client:
        yield client.server, tmp_path / "reader.token"


def test_a_caller_without_a_token_or_with_a_wrong_one(guarded):
    server, _ = guarded
    for token in (None, "wrong"):
        with polyest.connect(server, token=token) as client:
            with pytest.raises(polyest.Unauthenticated):
                client.status()


def test_a_role_that_does_not_allow_the_call(guarded, problem):
    server, token_file = guarded
    with polyest.connect(server, token_file=token_file) as client:
        assert client.sessions() == []
        with pytest.raises(polyest.PermissionDenied) as raised:
            client.session("written", problem)
    assert isinstance(raised.value, PermissionError)


@pytest.mark.parametrize(("options", "said"), [
    ({"token": "secret"}, "is not a loopback address; tokens are sent only over TLS"),
    ({"token": "two words", "ca": "x"}, "must be one word"),
    ({"token_file": "/nowhere"}, "token_file: /nowhere cannot be read"),
    ({"ca": "/nowhere"}, "ca: /nowhere cannot be read"),
    ({"ca": "/dev/null"}, "ca: /dev/null has no certificate in PEM form"),
    ({"certificate": "/dev/null", "key": "/dev/null"},
     "certificate: /dev/null has no certificate in PEM form"),
    ({"certificate": "x"}, "a certificate and its key must be given together"),
])
def test_a_connection_that_cannot_be_safe(options, said):
    with pytest.raises(polyest.InvalidInput, match=said):
        polyest.connect("rig.example.org:50051", **options)


@pytest.mark.parametrize("server", [
    "foo", "", ":50051", "foo:", "foo:0", "127.0.0.1:99999", "foo:65536", "foo:-1", "foo:+5",
    "foo: 5", "foo:5 ", "foo:５", "foo:grpc", 50051,
])
def test_an_address_is_that_of_a_host_with_a_port(server):
    async def asynchronous():
        polyest.aio.connect(server)

    for call in (lambda: polyest.connect(server), lambda: asyncio.run(asynchronous())):
        with pytest.raises(polyest.InvalidInput) as raised:
            call()
        assert raised.value.message == (f'server: "{server}" must be HOST:PORT, the port from 1 to '
                                        "65535")
        assert raised.value.field == "server"


@pytest.mark.parametrize("server", ["http://rig:50051", "rig/v1:50051"])
def test_an_address_is_no_url(server):
    with pytest.raises(polyest.InvalidInput, match='must be HOST:PORT.*without "http://"'):
        polyest.connect(server)


@pytest.mark.parametrize("server", [
    "::1", "::1:50051", "2001:db8::1:50051", "fe80::1%eth0:50051",
])
def test_an_ipv6_address_needs_brackets(server):
    with pytest.raises(polyest.InvalidInput, match=r"an IPv6 address in brackets, as in \[::1\]:50051"):
        polyest.connect(server)


@pytest.mark.parametrize("server", ["rig:1", "[::1]:65535", "127.0.0.1:00050051"])
def test_addresses_that_the_command_takes(server):
    with polyest.connect(server) as client:
        assert client.server == server


class Answering(grpc.GenericRpcHandler):
    """Answers every call with one message, or one status and its details."""

    def __init__(self):
        self.code, self.details, self.answer = grpc.StatusCode.UNKNOWN, [], None

    def service(self, call):
        def answer(request, context):
            if self.answer is not None:
                return self.answer.SerializeToString()
            status = error_details_pb2.Status(code=self.code.value[0], message="because")
            for detail in self.details:
                status.details.append(any_pb2.Any(
                    type_url=f"type.googleapis.com/google.rpc.{detail.DESCRIPTOR.name}",
                    value=detail.SerializeToString()))
            context.set_trailing_metadata((("grpc-status-details-bin",
                                            status.SerializeToString()),))
            context.abort(self.code, "because")

        return grpc.unary_unary_rpc_method_handler(answer)


@pytest.fixture(scope="module")
def answering():
    """A server that answers as it is told, and a client of it."""
    handler = Answering()
    server = grpc.server(futures.ThreadPoolExecutor(2), handlers=[handler])
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    with polyest.connect(f"127.0.0.1:{port}") as client:
        yield handler, client
    server.stop(None).wait()


@pytest.mark.parametrize("code", CODES, ids=lambda code: code.name)
def test_every_status_has_its_exception(answering, code):
    handler, client = answering
    handler.code, handler.details = code, []
    with pytest.raises(polyest.PolyestError, match="because") as raised:
        client.status()
    assert raised.value.code == code.name
    named = {kind.code: kind for kind in vars(polyest).values()
             if isinstance(kind, type) and issubclass(kind, polyest.PolyestError)
             and kind is not polyest.WrongType}
    assert type(raised.value) is named.get(code.name, polyest.PolyestError)


def test_details_are_read_under_their_standard_names(answering):
    handler, client = answering
    bad = error_details_pb2.BadRequest()
    bad.field_violations.add(field="measured[0].noise", description="must be positive")
    info = error_details_pb2.ErrorInfo(reason="DISK_FULL", domain="polyest")
    info.metadata["limit"] = "--max-disk-mb"
    retry = error_details_pb2.RetryInfo()
    retry.retry_delay.FromMilliseconds(2500)
    handler.code, handler.details = grpc.StatusCode.RESOURCE_EXHAUSTED, [bad, info, retry]
    with pytest.raises(polyest.ResourceExhausted) as raised:
        client.status()
    error = raised.value
    assert (error.field, error.rule) == ("measured[0].noise", "must be positive")
    assert (error.reason, error.limit) == ("DISK_FULL", "--max-disk-mb")
    assert error.retry and error.retry_after_s == 2.5


def test_answers_may_be_larger_than_four_megabytes(answering):
    handler, client = answering
    handler.answer = problem_service_pb2.GetProblemSchemaResponse(json_schema="x" * (5 << 20))
    assert len(client.problem_schema()) == 5 << 20


def test_threads_share_a_client(client, problem, record):
    found = []
    threads = [threading.Thread(target=lambda: found.append(client.estimate(problem, record)))
               for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({str(one.to_dict()) for one in found}) == 1 and len(found) == 4
