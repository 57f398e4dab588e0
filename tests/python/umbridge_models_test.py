"""Sessions as models of `polyestd --umbridge`: PyPI's client, differences, callers and bad input."""

import contextlib
import json
import os
import subprocess
import urllib.error
import urllib.request

import numpy as np
import pytest

import polyest
from polyest import _daemon

# Within the oscillator's posterior, whose standard deviations are about 0.007 N/m and 0.002 N s/m.
POINT = [41.3, 0.23]
STEPS = [1e-3, 2e-4]


@contextlib.contextmanager
def started(*arguments):
    """A daemon with a port for UM-Bridge, and the port's URL."""
    daemon = _daemon.start(os.environ.get("POLYEST_DAEMON"),
                           arguments=["--umbridge", "127.0.0.1:0", *arguments])
    try:
        line = daemon._shell.stdout.readline().decode()
        assert line.startswith("UM-Bridge models on http://127.0.0.1:")
        yield daemon, line.split()[-1].rstrip("/")
    finally:
        daemon.stop()


@pytest.fixture(scope="module")
def served():
    with started() as (daemon, url), polyest.connect(daemon.address) as client:
        yield client, url


@pytest.fixture
def session(served, problem, record):
    """The URL; the model `run7` has the oscillator's record."""
    client, url = served
    with client.session("run7", problem) as session:
        session.append(record)
        session.estimate()
        yield url
        session.delete()


def post(url, path, token=None, host=None, **message):
    """Returns the status and the message of an answer."""
    headers = {"Content-Type": "application/json"}
    headers.update({"Authorization": f"Bearer {token}"} if token else {})
    headers.update({"Host": host} if host else {})
    request = urllib.request.Request(url + path, json.dumps(message).encode(), headers)
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)


def test_pypis_client_finds_the_model_with_exact_derivatives(session):
    umbridge = pytest.importorskip("umbridge")
    assert umbridge.supported_models(session) == ["run7"]
    model = umbridge.HTTPModel(session, "run7")
    assert model.get_input_sizes() == [2]
    assert model.get_output_sizes() == [1, 1]
    assert model.supports_evaluate() and model.supports_gradient()
    assert model.supports_apply_jacobian() and model.supports_apply_hessian()
    # The expansion is a polynomial of degree 3 or a little more, its log likelihood one of twice
    # that. A central difference errs by about h²|f‴|/6, here below 1e-3 of the derivative that a
    # standard deviation makes: 1/s of the gradient, 1/s² of the Hessian.
    for output in (0, 1):
        for i, h in enumerate(STEPS):
            up, down = ([x + sign * h * (i == k) for k, x in enumerate(POINT)] for sign in (1, -1))
            unit = [float(i == k) for k in range(2)]
            slope = (model([up])[output][0] - model([down])[output][0]) / (2 * h)
            bend = (np.array(model.gradient(output, 0, [up], [1.0]))
                    - model.gradient(output, 0, [down], [1.0])) / (2 * h)
            gradient = model.gradient(output, 0, [POINT], [1.0])
            hessian = np.array(model.apply_hessian(output, 0, 0, [POINT], [2.0], unit))
            scale = np.sqrt(np.abs(np.diag([hessian[i] / 2])))[0, 0]
            assert slope == pytest.approx(gradient[i], abs=1e-3 * scale)
            assert hessian == pytest.approx(2 * bend, rel=1e-3, abs=1e-3 * np.abs(hessian).max())
            jacobian = model.apply_jacobian(output, 0, [POINT], unit)
            assert jacobian == pytest.approx([gradient[i]], rel=1e-12)


def test_later_measurements_count(served, problem, rows):
    client, url = served
    with client.session("growing", problem) as session:
        session.append(rows(0, 100))
        session.estimate()
        before = post(url, "/Evaluate", name="growing", input=[POINT])[1]["output"]
        session.append(rows(100, 200))
        session.estimate()
        after = post(url, "/Evaluate", name="growing", input=[POINT])[1]["output"]
        session.delete()
    assert before != after


def test_what_is_wrong_is_the_protocols_error(session):
    def error(path, **message):
        status, answer = post(session, path, **message)
        assert status in (400, 404)
        return answer["error"]["type"], answer["error"]["message"]

    assert error("/Evaluate", name="other", input=[POINT])[0] == "ModelNotFound"
    assert error("/Evaluate", name="run7", input=[[1, 2, 3]])[0] == "InvalidInput"
    assert error("/Evaluate", name="run7", input=[[*POINT, *POINT]]) == (
        "InvalidInput", "input[0]: has 4 numbers; the model takes 2: k, c")
    kind, text = error("/Evaluate", name="run7", input=[[41.3, 0.5]])
    assert (kind, text) == ("InvalidInput", "input: point 1 (k = 41.3, c = 0.5) lies outside of the "
                                            "prior's support")
    kind, text = error("/Evaluate", name="run7", input=[[32.0, 0.23]])
    assert kind == "InvalidInput" and "the expansion is not trusted there" in text
    assert error("/Gradient", name="run7", input=[POINT], outWrt=5)[0] == "InvalidInput"
    assert error("/Nothing", name="run7")[0] == "InvalidRequest"


def test_foreign_pages_do_not_reach_it(session):
    status, answer = post(session, "/Evaluate", host="evil.example.org", name="run7", input=[POINT])
    assert status == 403 and answer["error"]["type"] == "PermissionDenied"


def test_a_readers_token_suffices_and_none_does_not(tmp_path, problem, rows):
    program = _daemon.find_program(None)
    tokens, lines = {}, []
    for role in ("reader", "writer"):
        made = subprocess.run([program, "--new-token", f"me:rig:{role}"], capture_output=True,
                              text=True, check=True)
        tokens[role] = made.stdout.strip()
        lines.append(made.stderr)
    (tmp_path / "tokens").write_text("".join(lines))
    with started("--tokens", str(tmp_path / "tokens")) as (daemon, url):
        with polyest.connect(daemon.address, token=tokens["writer"]) as client, \
                client.session("run7", problem) as session:
            session.append(rows(0, 200))
            session.estimate()
        status, answer = post(url, "/Evaluate", name="run7", input=[POINT])
        assert status == 401 and answer["error"]["type"] == "Unauthenticated"
        status, answer = post(url, "/Info", token="wrong")
        assert status == 401
        status, answer = post(url, "/Info", token=tokens["reader"])
        assert answer == {"protocolVersion": 1.0, "models": ["run7"]}
        status, answer = post(url, "/Evaluate", token=tokens["reader"], name="run7", input=[POINT])
        assert status == 200 and [len(output) for output in answer["output"]] == [1, 1]
