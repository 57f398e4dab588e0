"""Tests that sessions go into files and come back."""

import os
import re
from concurrent import futures
from pathlib import Path
from types import SimpleNamespace

import pytest

import polyest


def test_an_exported_session_has_the_same_estimate(client, problem, rows, tmp_path):
    file = tmp_path / "run.polyest"
    with client.session("exported", problem) as session:
        session.append(rows(0, 200))
        session.append(rows(200, 400))
        session.export(file)
        expected = session.estimate().to_dict()
    restored = client.import_session(file, "imported")
    assert restored.name == "imported"
    assert restored.estimate().to_dict() == expected


def test_a_damaged_session_file_is_refused(client, problem, rows, tmp_path):
    file = tmp_path / "run.polyest"
    with client.session("damaged", problem) as session:
        session.append(rows(0, 200))
        session.export(file)
    whole = file.read_bytes()
    for cut in (1, 4, 9, 10, len(whole) // 2):  # the last record, the end, is of ten bytes
        file.write_bytes(whole[:-cut])
        with pytest.raises(polyest.InvalidInput, match="is cut off or missing"):
            client.import_session(file, "cut-off")
    file.write_bytes(whole + b"\0")
    with pytest.raises(polyest.InvalidInput, match="is the end, but more follows"):
        client.import_session(file, "longer")
    beginning = whole.index(b"\n") + 9
    for at in (beginning, len(whole) // 2, len(whole) - 20):
        file.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1:])
        with pytest.raises(polyest.InvalidInput, match="is damaged"):
            client.import_session(file, "flipped")
    names = {one.name for one in client.sessions()}
    assert "damaged" in names and not {"cut-off", "longer", "flipped"} & names


def test_an_exported_file_is_on_the_disk_before_it_has_its_name(
        client, problem, rows, tmp_path, monkeypatch):
    file, synced = tmp_path / "run.polyest", []
    real = os.fsync
    monkeypatch.setattr(os, "fsync", lambda descriptor: (
        synced.append((os.readlink(f"/proc/self/fd/{descriptor}"), file.exists())),
        real(descriptor)))
    with client.session("synced", problem) as session:
        session.append(rows(0, 200))
        session.export(file)
    (draft, _), *others = synced
    assert re.fullmatch(rf"{file}\.[0-9a-f]+\.part", draft) and not synced[0][1]
    assert others == [(str(tmp_path), True)]
    assert list(tmp_path.iterdir()) == [file]


@pytest.fixture
def kept(client, problem, rows):
    """A session with rows."""
    with client.session("kept", problem) as session:
        session.append(rows(0, 10))
        yield session
    client.delete_session("kept")


def test_an_export_that_cannot_be_written_leaves_nothing(kept, tmp_path):
    (tmp_path / "folder").mkdir()
    for name, why in (("folder", "Is a directory"), ("none/file", "No such file or directory")):
        with pytest.raises(polyest.InvalidInput, match=f"{name}: cannot be written: {why}") as one:
            kept.export(tmp_path / name)
        assert one.value.field == "file"
    assert [one.name for one in tmp_path.iterdir()] == ["folder"]
    with pytest.raises(polyest.ResourceExhausted, match="/dev/full: cannot be written") as full:
        kept.export("/dev/full")
    assert full.value.reason == "DISK_FULL"


def test_an_export_replaces_no_other_file(kept, client, tmp_path):
    target, link, other = tmp_path / "target", tmp_path / "link", tmp_path / "link.part"
    target.write_text("old")
    other.write_text("another's")
    link.symlink_to(target)
    kept.export(link)
    assert link.is_symlink() and other.read_text() == "another's"
    assert client.import_session(target, "by-link").estimate().samples == 10
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with futures.ThreadPoolExecutor(1) as executor:
        reading = executor.submit(pipe.read_bytes)
        kept.export(pipe)
        other.write_bytes(reading.result())
    assert pipe.is_fifo()
    assert client.import_session(other, "by-pipe").estimate().samples == 10


def test_a_session_file_that_cannot_be_read_is_named(client, tmp_path):
    with pytest.raises(polyest.InvalidInput, match="none: cannot be read: No such file") as raised:
        client.import_session(tmp_path / "none")
    assert raised.value.field == "file"
    with pytest.raises(polyest.WrongType, match="file: 5 of the type int must be the path"):
        client.import_session(5)


def test_an_import_that_is_interrupted_is_cancelled(client, tmp_path, monkeypatch):
    done = []

    def interrupted():
        done.append("interrupted")
        raise KeyboardInterrupt

    call = SimpleNamespace(result=interrupted, cancel=lambda: done.append("cancelled"))
    begins = SimpleNamespace(future=lambda requests, metadata: call)
    monkeypatch.setattr(client._transport, "_channel", SimpleNamespace(
        stream_unary=lambda *_: begins))
    with pytest.raises(KeyboardInterrupt):
        client.import_session(tmp_path / "run.polyest")
    assert done == ["interrupted", "cancelled"]


def test_a_file_of_the_version_before_is_imported(client, tmp_path):
    stored = Path(__file__).parent.parent / "integration" / "stored" / "session.polyest"
    restored = client.import_session(stored, "of-before")
    assert restored.estimate().samples == 200
    cut = tmp_path / "cut.polyest"
    cut.write_bytes(stored.read_bytes()[:-100])
    with pytest.raises(polyest.InvalidInput, match="is cut off or damaged"):
        client.import_session(cut, "of-before-cut")
