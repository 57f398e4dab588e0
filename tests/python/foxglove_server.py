"""A server of Foxglove's WebSocket protocol, for tests of a bridge that listens to one."""

import json
import struct
import threading

from websockets.sync.server import serve

PROTOCOL = "foxglove.websocket.v1"


class FoxgloveServer:
    """Announces channels and sends messages to whoever has subscribed."""

    def __init__(self, channels, port=0):
        """`channels` are as the protocol announces them, without their numbers."""
        self.channels = [{"id": number, "schemaName": "any", "schema": "", **one}
                         for number, one in enumerate(channels, 10)]
        self.subscribed = {}  # number of the channel → (connection, number of the subscription)
        self.lock = threading.Lock()
        self.server = serve(self._serve, "127.0.0.1", port, subprotocols=[PROTOCOL])
        self.port = self.server.socket.getsockname()[1]
        self.thread = threading.Thread(target=self.server.serve_forever, daemon=True)
        self.thread.start()

    @property
    def url(self):
        return f"ws://127.0.0.1:{self.port}"

    def _serve(self, connection):
        self.connection = connection
        connection.send(json.dumps({"op": "serverInfo", "name": "rig", "capabilities": ["time"]}))
        connection.send(json.dumps({"op": "advertise", "channels": self.channels}))
        for message in connection:
            asked = json.loads(message)
            assert asked["op"] == "subscribe"
            with self.lock:
                for one in asked["subscriptions"]:
                    self.subscribed[one["channelId"]] = connection, one["id"]

    def wait_for_subscriptions(self, wait_for, topics):
        """Waits until somebody has subscribed to these topics, and to no others."""
        numbers = {one["id"] for one in self.channels if one["topic"] in topics}
        wait_for(lambda: set(self.subscribed) == numbers)

    def send(self, topic, time_ns, payload):
        """Sends a message of a topic, which is bytes or becomes JSON."""
        data = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
        number = next(one["id"] for one in self.channels if one["topic"] == topic)
        with self.lock:
            connection, subscription = self.subscribed[number]
        connection.send(struct.pack("<BIQ", 1, subscription, time_ns) + data)

    def tell(self, **message):
        """Sends something other than a message of a topic."""
        self.connection.send(json.dumps(message))

    def close(self):
        """Ends the server and its connections."""
        self.server.shutdown()
        if getattr(self, "connection", None) is not None:
            self.connection.close()
        self.thread.join(10)
