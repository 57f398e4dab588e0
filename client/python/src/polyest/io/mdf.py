"""Measurement files MDF 3 and MDF 4 (ASAM), as `polyest[mdf]` reads them with asammdf."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Optional, Union

import numpy as np

from polyest._table import Array, Floats, floats, refuse, seconds_in
from polyest.errors import InvalidInput
from polyest.io._choices import check_channels, needed, units_of, unknown
from polyest.io._merge import Track, merged
from polyest.io._recording import Recording
from polyest.io._rows import TimeZero, batches, check_options

__all__ = ["Channel", "ChannelInfo", "channels", "read"]

File = Union[str, "os.PathLike[str]"]


# Samples of a channel that are read at a time: a compressed block is unpacked for each read.
_READ = 100_000


@dataclass(frozen=True)
class Channel:
    """Says which channel is meant where its name alone does not, and how it is read."""

    #: The channel's name.
    name: str
    #: The number of its group, from 0, as `channels` lists it; None: only one has the name.
    group: Optional[int] = None
    #: Whether its numbers are those in the file: for channels whose values have names.
    raw: bool = False


@dataclass(frozen=True)
class ChannelInfo:
    """A channel of a file."""

    #: Its name.
    name: str
    #: The number of its group, from 0; channels of a group share their times.
    group: int
    #: The name that the group has; may be empty.
    group_name: str
    #: Its unit as the file writes it; may be empty.
    unit: str
    #: The number of its samples.
    samples: int
    _index: int = 0
    _raw: bool = False

    def __str__(self) -> str:
        named = f" ({self.group_name})" if self.group_name else ""
        unit = f" in {self.unit}" if self.unit else ""
        return f"Channel('{self.name}', group={self.group}){named}: {self.samples} samples{unit}"


#: A channel by its name, or by name and group where several have the name.
Choice = Union[str, Channel]


def channels(file: File) -> list[ChannelInfo]:
    """Returns the channels of a file, without those of the time. Raises InvalidInput."""
    with _open(file) as opened:
        return _listed(opened)


def read(file: File, channels: Mapping[str, Choice], *,
         units: Optional[Mapping[str, str]] = None, time_zero: TimeZero = "auto", run: int = 0,
         batch_rows: int = 10_000) -> Recording:
    """Returns the channels of a file as a recording.

    channels: the file's channel for each output and streamed input of the problem, as in
        {"x": "SUSP.defl"}, or {"x": Channel("defl", group=2)} where several have the name.
    units: of channels, as in {"x": "mm"}, instead of the file's; "" means the model's.
    time_zero: "file" keeps the file's times, s since the measurement began; "first" makes the first
        row t = 0; "auto" is "file" here, since these times are no dates.
    run: of the record, ≥ 0.
    batch_rows: the most rows of a batch; memory holds some 100,000 samples of each channel.

    Samples that the file marks as invalid are missing, and so are NaN and, among numbers, values
    that the file has a text for. Times without a unit are in s. Raises InvalidInput, which is a
    ValueError, for a file that is none, a name that does not exist (it lists the nearest) or that
    several channels have, channels of text or of several dimensions, groups without time or in an
    unknown unit of time, and times that decrease; ImportError without asammdf.
    """
    check_channels(channels)
    check_options(time_zero, batch_rows)
    name = os.fspath(file)
    with _open(file) as opened:
        found = {quantity: _find(opened, quantity, _choice(choice))
                 for quantity, choice in channels.items()}
    chosen = units_of({quantity: one.unit for quantity, one in found.items()}, units)

    def pieces() -> Iterator[Mapping[str, tuple[Array, Floats]]]:
        with _open(file) as opened:
            yield from merged(name, [_track(opened, quantity, one)
                                     for quantity, one in found.items()])

    return Recording(name, chosen, lambda: batches(
        name, pieces(), chosen, run=run, time_zero=time_zero, batch_rows=batch_rows))


def _open(file: File) -> Any:
    asammdf = needed("asammdf", "mdf")
    name = os.fspath(file)
    try:
        with open(name, "rb") as opened:
            if opened.read(3) not in (b"MDF", b"UnF"):
                raise refuse(name, "is no MDF file")
        return asammdf.MDF(name, process_bus_logging=False)
    except OSError as error:
        raise InvalidInput(f"{name}: cannot be opened: {error.strerror}") from error
    except InvalidInput:
        raise
    except Exception as error:  # what asammdf raises for damaged files has no common class
        raise InvalidInput(f"{name}: is damaged, or no MDF file: {error}") from error


def _listed(opened: Any) -> list[ChannelInfo]:
    found = []
    for number, group in enumerate(opened.groups):
        described = group.channel_group
        for index, channel in enumerate(group.channels):
            if index != opened.masters_db.get(number):
                found.append(ChannelInfo(
                    channel.name, number, getattr(described, "acq_name", "") or "",
                    channel.unit or "", int(described.cycles_nr), index))
    return found


def _choice(choice: Choice) -> Channel:
    return choice if isinstance(choice, Channel) else Channel(str(choice))


def _find(opened: Any, quantity: str, choice: Channel) -> ChannelInfo:
    """Returns a channel. Raises InvalidInput if there is none or several are meant."""
    field, wanted = f"channels.{quantity}", choice.name
    listed = _listed(opened)
    # The file may know a channel by more names than its own.
    places = set(opened.channels_db.get(wanted, ()))
    found = [one for one in listed if (one.group, one._index) in places or one.name == wanted]
    if not found:
        raise unknown(field, "channel", wanted, (one.name for one in listed))
    if choice.group is not None:
        found = [one for one in found if one.group == choice.group] or found
        if found[0].group != choice.group:
            raise refuse(field, f"group {choice.group} has no channel '{wanted}'; there are "
                         f"{'; '.join(map(str, found))}")
    if len(found) > 1:
        raise refuse(field, f"{len(found)} channels are named '{wanted}': "
                     f"{'; '.join(map(str, found))}")
    return replace(found[0], _raw=choice.raw)


def _track(opened: Any, quantity: str, one: ChannelInfo) -> Track:
    """Yields times, s, and values of a channel; invalid ones are NaN. Raises InvalidInput."""
    factor = _seconds_of(opened, one)
    for first in range(0, one.samples, _READ):
        try:
            signal = opened.get(one.name, group=one.group, index=one._index, raw=one._raw,
                                record_offset=first, record_count=_READ,
                                ignore_invalidation_bits=True)
        except Exception as error:  # what asammdf raises for damaged files has no common class
            raise refuse(one.name, f"cannot be read: {error}") from error
        times = floats(f"the time of '{one.name}'", np.asarray(signal.timestamps))
        yield times * factor, {quantity: _values(one, signal)}


def _seconds_of(opened: Any, one: ChannelInfo) -> float:
    """Returns the length of the unit of a channel's times, s."""
    # Groups of a file that is stored by columns share the time of one of them.
    virtual = opened.virtual_groups_map.get(one.group) if hasattr(
        opened, "virtual_groups_map") else None
    sharing = [one.group] if virtual is None else opened.virtual_groups[virtual].groups
    for group in sharing:
        index = opened.masters_db.get(group)
        if index is not None:
            master = opened.groups[group].channels[index]
            if getattr(master, "sync_type", 1) not in (0, 1):
                raise refuse(one.name, f"is sampled over '{master.name}', which is no time")
            return seconds_in(f"the time of '{one.name}'", getattr(master, "unit", "") or "")
    raise refuse(one.name, f"has no times: group {one.group} lacks them")


def _values(one: ChannelInfo, signal: Any) -> Floats:
    """Returns samples as numbers; those marked as invalid are NaN."""
    samples = np.asarray(signal.samples)
    if samples.dtype.kind in "SUO":
        raise refuse(one.name, "is no channel of numbers but of text; where its values are numbers "
                     f"with names, Channel('{one.name}', raw=True) takes the numbers")
    if samples.dtype.kind not in "fiub" or samples.ndim != 1:
        raise refuse(one.name, f"is no channel of numbers: it has values of type {samples.dtype} "
                     f"and shape {samples.shape[1:]}")
    if signal.invalidation_bits is not None:
        samples = np.where(np.asarray(signal.invalidation_bits, dtype=bool), np.nan, samples)
    return floats(one.name, samples)
