"""A daemon for the tests of a file, and the oscillator of the examples."""

import os
import pathlib

import numpy as np
import pytest

import polyest
from polyest import _daemon

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "client" / "examples"
# How generate_demo.cc made oscillator.csv.
TRUTH = {"k": 41.3, "c": 0.23}


@pytest.fixture(scope="session")
def client():
    """A client of a daemon that keeps sessions in memory."""
    with polyest.local() as found:
        yield found


@pytest.fixture
def problem():
    """A mass on a spring whose stiffness and damping are not known."""
    return (polyest.Problem.builtin("mass_spring_damper")
            .fix(m=1.0, x0=1.0)
            .uncertain("k", polyest.Uniform(31.584, 47.376))
            .uncertain("c", polyest.Uniform(0.1, 0.3))
            .measure("x", noise=0.01))


@pytest.fixture(scope="session")
def record():
    """The oscillator's record as columns of numbers."""
    table = np.genfromtxt(EXAMPLES / "oscillator.csv", delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names}


@pytest.fixture
def rows(record):
    """Returns the rows from one number to before another."""
    return lambda first, last: {name: values[first:last] for name, values in record.items()}


@pytest.fixture
def restartable(tmp_path):
    """Starts daemons one after the other on one port, with one folder of sessions."""
    started = []

    def start(*arguments, durable=True):
        # At 127.0.0.1 an attempt to connect while no daemon runs might come from the very port that
        # it looks for, and take it.
        listen = started[-1].address if started else "127.0.0.2:0"
        started.append(_daemon.start(os.environ.get("POLYEST_DAEMON"),
                                     tmp_path / "sessions" if durable else None, listen, arguments))
        return started[-1]

    yield start
    for daemon in started:
        daemon.kill()
