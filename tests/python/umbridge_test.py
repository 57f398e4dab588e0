"""Models of UM-Bridge servers: PyPI's own server, servers that die, and bad descriptions."""

import contextlib
import json
import socket
import subprocess
import sys
import threading

import pytest

import polyest
from conftest import EXAMPLES

SERVE = EXAMPLES / "umbridge"
sys.path.insert(0, str(SERVE))
import serve  # noqa: E402  (the example is a script beside its problem)

PROBLEM = SERVE / "oscillator.json"

# The example's server at a given port. It breaks off every so many answers after the header, and dies.
# At 127.0.0.1 another program, or an attempt to connect, might take the port while no server has it.
MORTAL = """
import os, sys
sys.path.insert(0, sys.argv[1])
import serve
left = int(sys.argv[3])
class Mortal(serve.Handler):
    def answer(self, status, message):
        global left
        left -= 1
        if left == 0:
            self.send_response(status)
            self.end_headers()
            self.wfile.flush()
            os._exit(9)
        super().answer(status, message)
server = serve.Server(("127.0.0.2", int(sys.argv[2])), Mortal)
print(server.server_port, flush=True)
server.serve_forever()
"""

# A model as the documentation of PyPI's package has them.
PYPI = """
import sys
sys.path.insert(0, sys.argv[1])
import serve, umbridge
class Oscillator(umbridge.Model):
    def get_input_sizes(self, config): return [2]
    def get_output_sizes(self, config): return [len(config["times"])]
    def supports_evaluate(self): return True
    def __call__(self, parameters, config):
        return [serve.displacements(*parameters[0], config["times"])]
umbridge.serve_models([Oscillator("oscillator")], int(sys.argv[2]))
"""


def describe(folder, urls, name="oscillator", **more):
    """Writes a description of an example's model at these servers."""
    text = json.dumps({**serve.describe(name, urls), **more})
    (folder / f"{name}.umbridge.json").write_text(text)


@contextlib.contextmanager
def served():
    """The example's server in this process: its URL."""
    server = serve.Server(("127.0.0.1", 0), serve.Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("models")


@pytest.fixture(scope="module")
def daemon(folder):
    """A client of a daemon that reads descriptions in the folder."""
    with polyest.local(arguments=["--umbridge-dir", str(folder)]) as found:
        yield found


@pytest.fixture(scope="module")
def undisturbed(daemon, folder, record_of_module):
    with served() as url:
        describe(folder, [url])
        return daemon.estimate(PROBLEM, record_of_module)


def example_record(name):
    import numpy as np

    table = np.genfromtxt(EXAMPLES / f"{name}.csv", delimiter=",", names=True)
    return {column: table[column] for column in table.dtype.names}


@pytest.fixture(scope="module")
def record_of_module():
    return example_record("oscillator")


class Mortals:
    """Servers in processes of their own that die and are started again at their ports."""

    def __init__(self, lives):
        self.deaths = 0
        self._ended = False
        self._lock = threading.Lock()
        self._processes = [self._start(0, life) for life in lives]
        self.urls = [f"http://127.0.0.2:{port}" for _, port in self._processes]
        self._threads = [threading.Thread(target=self._revive, args=(i, life))
                         for i, life in enumerate(lives)]
        for thread in self._threads:
            thread.start()

    @staticmethod
    def _start(port, life):
        process = subprocess.Popen([sys.executable, "-c", MORTAL, str(SERVE), str(port), str(life)],
                                   stdout=subprocess.PIPE, text=True)
        return process, int(process.stdout.readline())

    def _revive(self, index, life):
        while True:
            process, port = self._processes[index]
            process.wait()
            with self._lock:
                if self._ended:
                    return
                self.deaths += 1
                self._processes[index] = self._start(port, life)

    def end(self):
        with self._lock:
            self._ended = True
            for process, _ in self._processes:
                process.kill()
        for thread in self._threads:
            thread.join()
        for process, _ in self._processes:
            process.stdout.close()


def test_an_estimate_through_dying_servers_has_the_same_bits(daemon, folder, undisturbed,
                                                             record_of_module):
    mortals = Mortals([7, 11, 13])
    try:
        describe(folder, mortals.urls)
        disturbed = daemon.estimate(PROBLEM, record_of_module)
    finally:
        mortals.end()
    assert disturbed.to_dict() == undisturbed.to_dict()
    assert mortals.deaths >= 10


def test_the_server_of_pypis_package_gives_the_same_estimate(daemon, folder, undisturbed,
                                                             record_of_module):
    pytest.importorskip("umbridge")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with subprocess.Popen([sys.executable, "-c", PYPI, str(SERVE), str(port)],
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server:
        try:
            describe(folder, [f"http://127.0.0.1:{port}"])  # polyest waits until it listens
            estimate = daemon.estimate(PROBLEM, record_of_module)
        finally:
            server.kill()
    assert estimate.to_dict() == undisturbed.to_dict()


def test_a_model_driven_by_a_measured_road_gives_the_builtin_models_estimate(daemon, folder):
    record = example_record("quarter_car")
    with served() as url:
        describe(folder, [url], "corner")
        remote = daemon.estimate(SERVE / "corner.json", record)
    builtin = daemon.estimate(EXAMPLES / "quarter_car.json", record)
    assert len(remote.parameters) == 3
    for one, other in zip(remote.parameters, builtin.parameters):
        # The server's steps and lines are as fine as that; the noise is of no concern.
        assert abs(one.mean - other.mean) < 0.05 * other.posterior_std_dev
        assert one.posterior_std_dev == pytest.approx(other.posterior_std_dev, rel=0.02)


def test_a_model_that_refuses_points_says_why(daemon, folder, record_of_module):
    problem = json.loads(PROBLEM.read_text())
    problem["uncertain"][0] = {"name": "k", "uniform": {"lower": 0.0001, "upper": 0.0002}}
    with served() as url:
        describe(folder, [url])
        with pytest.raises(polyest.FailedPrecondition, match="do not oscillate"):
            daemon.estimate(problem, record_of_module)


def test_no_server_is_named_with_its_fault(daemon, folder, record_of_module):
    describe(folder, ["http://127.0.0.1:1"], giveUpAfterS=0)
    with pytest.raises(polyest.Unavailable,
                       match="no server could be reached for 0 s .*127.0.0.1:1: no connection"):
        daemon.estimate(PROBLEM, record_of_module)


def test_a_bad_description_is_refused_with_its_fault(daemon, folder, record_of_module):
    describe(folder, [])
    with pytest.raises(polyest.InvalidInput, match=r"model.umbridge: .*urls: \[\] must be a list"):
        daemon.estimate(PROBLEM, record_of_module)
    with pytest.raises(polyest.InvalidInput, match="there is no UM-Bridge model \"pendulum\""):
        daemon.estimate({**json.loads(PROBLEM.read_text()), "model": {"umbridge": "pendulum"}},
                        record_of_module)


def test_a_daemon_without_a_folder_says_so(client, record_of_module):
    with pytest.raises(polyest.InvalidInput, match="--umbridge-dir"):
        client.estimate(PROBLEM, record_of_module)
