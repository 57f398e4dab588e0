"""Session files, as `polyest export` writes them.

A line, then records, each after its length and its CRC-32; the last record is the end. Files of the
version before, which have neither checksums nor an end, are read, too.
"""

from __future__ import annotations

import contextlib
import errno
import itertools
import os
import secrets
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Optional, Union

from google.protobuf import message

from polyest._files import file_error, path_of
from polyest._proto.v1 import session_service_pb2
from polyest.errors import InvalidInput

_FIRST_LINE = b"polyest session 2\n"
_FIRST_LINE_BEFORE = b"polyest session 1\n"
_NUMBER = struct.Struct("<I")
_BEFORE_RECORD = struct.Struct("<II")  # length, CRC-32


class SessionFileWriter:
    """Writes records to a draft beside the file, which takes its place at the end.

    A failed export leaves an existing file as it is; one that succeeds is on the disk. A link
    stays, and what it leads to is written; a device or pipe is written as it is.
    """

    def __init__(self, file: Union[str, os.PathLike[str]]) -> None:
        self._name = path_of("file", file)
        self._file = Path(os.path.realpath(self._name))
        self._draft: Optional[Path] = None

    def __enter__(self) -> SessionFileWriter:
        """Opens the file. Raises InvalidInput if it cannot be written."""
        try:
            if self._file.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            if self._file.exists() and not self._file.is_file():
                self._out = self._file.open("wb")
            else:
                draft = self._file.with_name(f"{self._file.name}.{secrets.token_hex(4)}.part")
                self._out = draft.open("xb")
                self._draft = draft
        except OSError as error:
            raise file_error(self._name, "cannot be written", error) from error
        self._guarded(lambda: self._out.write(_FIRST_LINE))
        return self

    def write(self, record: session_service_pb2.SessionRecord) -> None:
        """Appends a record. Raises PolyestError if the file cannot be written."""
        encoded = record.SerializeToString()
        self._guarded(lambda: self._out.write(
            _BEFORE_RECORD.pack(len(encoded), zlib.crc32(encoded)) + encoded))

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        """Puts the draft in the place of the file, or removes it after an exception."""
        try:
            if kind is None:
                self._guarded(self._finish)
        finally:
            with contextlib.suppress(OSError):  # what could not be flushed has been said
                self._out.close()
            if self._draft is not None:
                self._draft.unlink(missing_ok=True)

    def _finish(self) -> None:
        self._out.flush()
        if self._draft is None:
            self._out.close()
            return
        os.fsync(self._out.fileno())
        self._out.close()
        self._draft.replace(self._file)
        self._draft = None
        _sync_folder(self._file.parent)

    def _guarded(self, action: Callable[[], object]) -> None:
        try:
            action()
        except OSError as error:
            raise file_error(self._name, "cannot be written", error) from error


def read(file: Union[str, os.PathLike[str]]) -> Iterator[session_service_pb2.SessionRecord]:
    """Yields the records of a file.

    Raises InvalidInput if it cannot be read, is no session file, is damaged or cut short.
    """
    name = path_of("file", file)
    try:
        with open(name, "rb") as source:
            yield from _records(name, source)
    except OSError as error:
        raise file_error(name, "cannot be read", error) from error


def _records(file: str, source: BinaryIO) -> Iterator[session_service_pb2.SessionRecord]:
    first_line = source.readline(len(_FIRST_LINE))
    if first_line == _FIRST_LINE_BEFORE:
        yield from _read_unchecked(file, source)
        return
    if first_line != _FIRST_LINE:
        raise InvalidInput(f"{file}: is not a session file written by an export")
    for number in itertools.count(1):
        length = _read_number(source)
        checksum = _read_number(source)
        encoded = source.read(length or 0)
        where = f"{file}: record {number}"
        if length is None or checksum is None or len(encoded) < length:
            raise InvalidInput(f"{where} is cut off or missing: the file is incomplete")
        if zlib.crc32(encoded) != checksum:
            raise InvalidInput(f"{where} is damaged: its checksum is not that of its bytes")
        try:
            record = session_service_pb2.SessionRecord.FromString(encoded)
        except message.DecodeError as error:
            raise InvalidInput(f"{where} is damaged: {error}") from error
        ended = record.HasField("end")
        if ended and source.read(1):
            raise InvalidInput(f"{where} is the end, but more follows: the file is damaged")
        yield record
        if ended:
            return


def _read_unchecked(file: str, source: BinaryIO) -> Iterator[session_service_pb2.SessionRecord]:
    """Yields the records of a file of the version before: each after its length, a varint."""
    for number in itertools.count(1):
        length, shift = 0, 0
        for byte in iter(lambda: source.read(1), b""):
            length |= (byte[0] & 0x7f) << shift
            shift += 7
            if byte[0] < 0x80 or shift > 63:
                break
        else:
            if shift == 0:
                break
        encoded = source.read(length)
        try:
            if len(encoded) < length:
                raise message.DecodeError("cut off")
            yield session_service_pb2.SessionRecord.FromString(encoded)
        except message.DecodeError:
            raise InvalidInput(f"{file}: record {number} is cut off or damaged") from None
    yield session_service_pb2.SessionRecord(end=session_service_pb2.SessionRecord.End())


def _read_number(source: BinaryIO) -> Optional[int]:
    encoded = source.read(_NUMBER.size)
    return _NUMBER.unpack(encoded)[0] if len(encoded) == _NUMBER.size else None


def _sync_folder(folder: Path) -> None:
    """Brings the names in a folder to the disk, where the system can do that."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
