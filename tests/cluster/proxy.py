"""A TCP proxy whose connections a test can cut, hold up and let go on."""

import itertools
import selectors
import socket
import threading

# How long the proxy's threads wait before they look at its state again, s.
LOOK_S = 0.05


class Proxy:
    """Passes connections on to the first target that takes them, beginning with another one each time.

    A target is a function that returns a port of loopback or the path of a socket, or None while there
    is neither. While `held`
    has a target's number, its connections pass no bytes, as where a cable is broken; while `cut` has
    it, they are closed, and new ones go to other targets or are closed.
    """

    def __init__(self, *targets):
        self.targets = targets
        self.held, self.cut = set(), set()
        self._turn = itertools.count()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            client, _ = self._listener.accept()
            threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _connect(self):
        """Returns the number of a target and a connection to it; None if no target takes one."""
        first = next(self._turn)
        for i in range(len(self.targets)):
            number = (first + i) % len(self.targets)
            place = self.targets[number]()
            if place is None or number in self.cut:
                continue
            family = socket.AF_INET if isinstance(place, int) else socket.AF_UNIX
            server = socket.socket(family)
            try:
                server.connect(("127.0.0.1", place) if isinstance(place, int) else place)
                return number, server
            except OSError:
                server.close()
        return None

    def _serve(self, client):
        with client:
            connected = self._connect()
            if connected is None:
                return
            number, server = connected
            with server:
                self._pass(number, client, server)

    def _pass(self, number, client, server):
        with selectors.DefaultSelector() as selector:
            for end in (client, server):
                end.settimeout(5)
                selector.register(end, selectors.EVENT_READ)
            while number not in self.cut:
                if number in self.held:
                    threading.Event().wait(LOOK_S)
                    continue
                for key, _ in selector.select(LOOK_S):
                    other = server if key.fileobj is client else client
                    try:
                        received = key.fileobj.recv(1 << 16)
                        if received:
                            other.sendall(received)
                    except OSError:
                        return
                    if not received:
                        return
