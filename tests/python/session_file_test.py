"""Tests that sessions go into files and come back."""

import os
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
    assert synced == [(f"{file}.part", False), (str(tmp_path), True)]


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
