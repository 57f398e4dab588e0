"""Finds the values of channels in messages that come topic by topic, with their schemas."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from polyest.io._topics import Path, check_encoding, is_in, unit_of
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
            known = self._paths.get(quantity)
            # A longer topic fits better, as in files.
            if is_in(text, channel.topic) and (
                    known is None or len(known.topic) < len(channel.topic)):
                path = Path(f"channels.{quantity}", text, {channel.topic: channel})
                check_encoding(f"channels.{quantity}", channel)
                self.units[quantity] = unit_of(schema, channel, path.steps)
                self._paths[quantity] = path
        return any(path.topic == channel.topic for path in self._paths.values())

    def wants(self, topic: str) -> bool:
        """Returns whether a channel may be in a topic."""
        return any(is_in(text, topic) for text in self._channels.values())

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
