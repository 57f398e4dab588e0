"""The program that `polyest.local()` starts."""

import pytest

from polyest import _daemon
from polyest.errors import Unavailable


@pytest.fixture
def program(tmp_path, monkeypatch):
    """The newest program built above the working folder."""
    made = tmp_path / "build" / "release" / "bin" / "polyestd"
    made.parent.mkdir(parents=True)
    made.touch(mode=0o755)
    work = tmp_path / "client" / "examples"
    work.mkdir(parents=True)
    monkeypatch.chdir(work)
    monkeypatch.delenv("POLYEST_DAEMON", raising=False)
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(_daemon, "__file__", str(work / "_daemon.py"))
    return made


def _found():
    try:
        return _daemon.find_program(None)
    except Unavailable:
        return None


def test_is_the_newest_built_in_a_checkout_around_the_working_folder(program, tmp_path):
    (tmp_path / "proto" / "polyest").mkdir(parents=True)
    assert _found() == str(program)


def test_is_not_from_a_folder_that_is_no_checkout(program):
    assert _found() != str(program)


def test_is_not_from_a_checkout_that_anybody_can_change(program, tmp_path):
    (tmp_path / "proto" / "polyest").mkdir(parents=True)
    tmp_path.chmod(0o777)
    assert _found() != str(program)
