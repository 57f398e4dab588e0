"""Files that callers name: their paths, and what the system says when they cannot be used."""

from __future__ import annotations

import errno
import os
from typing import Any

from polyest._request import wrong
from polyest.errors import InvalidInput, PolyestError, ResourceExhausted


def path_of(argument: str, file: Any) -> str:
    """Returns a path as text. Raises WrongType for anything else.

    A number is no path: `open` takes it for a descriptor and closes it in the end.
    """
    if not isinstance(file, (str, os.PathLike)):
        raise wrong(argument, file, "the path of a file (str or os.PathLike)")
    return os.fsdecode(file)


def file_error(file: str, what: str, error: OSError) -> PolyestError:
    """Returns the exception for a file that `what`, as in "cannot be opened"."""
    message = f"{file}: {what}: {error.strerror or error}"
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return ResourceExhausted(message, reason="DISK_FULL")
    return InvalidInput(message, field="file", rule=f"{what}: {error.strerror or error}")
