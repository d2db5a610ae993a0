"""Many clients in one thread, each with a connection that it keeps.

A client is a generator: it yields what it asks, and goes on with the `Answer`; or `Pause`, and goes on after that.
So thousands of requests a second take a small part of a core, and what a client does reads like one.
"""

import dataclasses
import heapq
import itertools
import json
import selectors
import socket
import time


@dataclasses.dataclass
class Answer:
    status: int
    head: bytes
    body: bytes

    def json(self):
        return json.loads(self.body)

    def header(self, name):
        """Its value, or None."""
        for line in self.head.split(b"\r\n")[1:]:
            key, _, value = line.partition(b":")
            if key.lower() == name.lower().encode():
                return value.strip().decode()
        return None


@dataclasses.dataclass
class Pause:
    seconds: float


def ask(method, path, document=None, headers=()):
    """A whole request as it goes over the wire; a document is sent as JSON."""
    lines = [f"{method} {path} HTTP/1.1", "Host: 127.0.0.1", *headers]
    body = b""
    if document is not None:
        body = document if isinstance(document, bytes) else json.dumps(document).encode()
        lines += ["Content-Type: application/json", f"Content-Length: {len(body)}"]
    return "\r\n".join([*lines, "", ""]).encode() + body


class Lost(Exception):
    """The server has closed a connection, or answers in time no more."""


class _Wire:
    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._bytes = b""

    def receive(self):
        """The answer, once all of it is there; until then None."""
        piece = self.socket.recv(1 << 18)
        if not piece:
            raise Lost("the server has closed a connection")
        self._bytes += piece
        head, end, _ = self._bytes.partition(b"\r\n\r\n")
        if not end:
            return None
        at = head.lower().find(b"\r\ncontent-length:")
        length = int(head[at + 17 :].split(b"\r\n", 1)[0]) if at >= 0 else 0
        size = len(head) + 4 + length
        if len(self._bytes) < size:
            return None
        answer = Answer(int(head[9:12]), head, self._bytes[len(head) + 4 : size])
        self._bytes = self._bytes[size:]
        return answer


def drive(port, clients, patience=60):
    """Runs the clients until all have ended. Throws `Lost` where nothing comes for so many seconds."""
    with selectors.DefaultSelector() as selector:
        later, order = [], itertools.count()

        def go_on(client, wire, answer):
            try:
                wanted = client.send(answer)
            except StopIteration:
                selector.unregister(wire.socket)
                wire.socket.close()
                return
            if isinstance(wanted, Pause):
                heapq.heappush(later, (time.monotonic() + wanted.seconds, next(order), client, wire))
            else:
                wire.socket.sendall(wanted)

        try:
            for client in clients:
                wire = _Wire(port)
                selector.register(wire.socket, selectors.EVENT_READ, (client, wire))
                go_on(client, wire, None)
            while selector.get_map():
                wait = patience if not later else max(0.0, min(later[0][0] - time.monotonic(), patience))
                ready = selector.select(wait)
                for key, _ in ready:
                    client, wire = key.data
                    if answer := wire.receive():
                        go_on(client, wire, answer)
                if not ready and not later:
                    raise Lost(f"nothing has come for {patience} s")
                while later and later[0][0] <= time.monotonic():
                    _, _, client, wire = heapq.heappop(later)
                    go_on(client, wire, None)
        finally:
            for key in list(selector.get_map().values()):
                key.fileobj.close()
