"""Session files, as `polyest export` writes them: a line, then records after their lengths."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Optional, Union

from google.protobuf import message

from polyest._proto.v1 import session_service_pb2
from polyest.errors import InvalidInput

_FIRST_LINE = b"polyest session 1\n"


class SessionFileWriter:
    """Writes records to a draft beside the file, which takes its place at the end.

    A failed export leaves an existing file as it is; one that succeeds is on the disk.
    """

    def __init__(self, file: Union[str, os.PathLike[str]]) -> None:
        self._file = Path(file)
        self._draft = Path(f"{os.fspath(file)}.part")

    def __enter__(self) -> SessionFileWriter:
        self._out = self._draft.open("wb")
        self._out.write(_FIRST_LINE)
        return self

    def write(self, record: session_service_pb2.SessionRecord) -> None:
        """Appends a record."""
        encoded = record.SerializeToString()
        self._out.write(_varint(len(encoded)) + encoded)

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        if kind is None:
            self._out.flush()
            os.fsync(self._out.fileno())
            self._out.close()
            self._draft.replace(self._file)
            _sync_folder(self._file.parent)
        else:
            self._out.close()
            self._draft.unlink()


def read(file: Union[str, os.PathLike[str]]) -> Iterator[session_service_pb2.SessionRecord]:
    """Yields the records of a file. Raises InvalidInput if it is none, damaged or cut short."""
    # A number is no path: `open` takes it for a descriptor and closes it in the end.
    with open(os.fspath(file), "rb") as source:
        if source.readline(len(_FIRST_LINE)) != _FIRST_LINE:
            raise InvalidInput(f"{os.fspath(file)}: is not a session file written by an export")
        while True:
            length = _read_varint(source, os.fspath(file))
            if length is None:
                return
            encoded = source.read(length)
            if len(encoded) < length:
                raise InvalidInput(f"{os.fspath(file)}: ends in the middle of a record")
            try:
                record = session_service_pb2.SessionRecord.FromString(encoded)
            except message.DecodeError as error:
                raise InvalidInput(f"{os.fspath(file)}: is damaged: {error}") from error
            yield record


def _sync_folder(folder: Path) -> None:
    """Brings the names in a folder to the disk, where the system can do that."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _read_varint(source: BinaryIO, file: str) -> Optional[int]:
    value, shift = 0, 0
    while byte := source.read(1):
        value |= (byte[0] & 0x7F) << shift
        if value >> 31:  # no message of protobuf is that long
            raise InvalidInput(f"{file}: is damaged: a record is longer than 2 GiB")
        if byte[0] < 0x80:
            return value
        shift += 7
    if shift:
        raise InvalidInput(f"{file}: ends in the middle of a length")
    return None
