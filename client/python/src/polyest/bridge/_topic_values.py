"""Finds the values of channels in messages that come topic by topic, with their schemas."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from polyest.io._topics import Path, check_encoding, unit_of
from polyest.io.mcap import values_of


class TopicValues:
    """The channels of a bridge, each at a topic and field that is found when the topic is known.

    A topic's channel has the attributes of MCAP's: id, topic, message_encoding and metadata; its
    schema has name, encoding and data.
    """

    def __init__(self, channels: Mapping[str, str]) -> None:
        """`channels` has the topic and field of each of the problem's names."""
        self._channels = channels
        self._paths: dict[str, Path] = {}
        #: The unit of each channel, once its topic is known.
        self.units = {name: "" for name in channels}

    def find(self, schema: Any, channel: Any) -> bool:
        """Looks whether a topic has channels; returns whether it has.

        Raises InvalidInput for messages in another encoding than JSON and protobuf.
        """
        for quantity, text in self._channels.items():
            fits = text == channel.topic or text.startswith((f"{channel.topic}.",
                                                             f"{channel.topic}["))
            if quantity not in self._paths and fits:
                path = Path(f"channels.{quantity}", text, {channel.topic: channel})
                check_encoding(f"channels.{quantity}", channel)
                self._paths[quantity] = path
                self.units[quantity] = unit_of(schema, channel, path.steps)
        return any(path.topic == channel.topic for path in self._paths.values())

    def missing(self) -> dict[str, str]:
        """Returns the channels whose topic has not been found, with what was asked for."""
        return {quantity: text for quantity, text in self._channels.items()
                if quantity not in self._paths}

    def values(self, channel: Any, message: Any) -> dict[str, float]:
        """Returns the values in a message; those that it lacks are left out.

        Raises InvalidInput for one that is no number.
        """
        return values_of(self._paths, channel.topic, message)

    def lacking(self, channel: Any, values: Mapping[str, float]) -> dict[str, str]:
        """Returns the channels of a topic that are not among the values, with their paths."""
        return {quantity: path.text for quantity, path in self._paths.items()
                if path.topic == channel.topic and quantity not in values}
