"""Sends the same or similar requests over connections that are kept, and takes each one's time."""

import selectors
import socket
import time


def encode(path, body, headers):
    """A whole POST as it goes over the wire."""
    lines = [f"POST {path} HTTP/1.1", "Host: 127.0.0.1", f"Content-Length: {len(body)}"]
    lines += [f"{name}: {value}" for name, value in headers.items()]
    return "\r\n".join([*lines, "", ""]).encode() + body


class _Wire:
    """One connection with at most one request under way."""

    def __init__(self, host, port):
        self.socket = socket.create_connection((host, port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._buffer = bytearray(1 << 20)
        self._parts = []
        self._missing = None

    def send(self, request):
        self.began = time.perf_counter()
        self.socket.sendall(request)

    def receive(self):
        """Reads what is there; whether the answer is complete."""
        count = self.socket.recv_into(self._buffer)
        if count == 0:
            raise RuntimeError("the server has closed the connection")
        self._parts.append(bytes(memoryview(self._buffer)[:count]))
        if self._missing is None:
            head, end, _ = b"".join(self._parts).partition(b"\r\n\r\n")
            if not end:
                return False
            self.status = int(head[9:12])
            length = [line[15:] for line in head.split(b"\r\n") if line[:15].lower() == b"content-length:"]
            self._missing = len(head) + 4 + (int(length[0]) if length else 0)
            self._missing -= sum(map(len, self._parts[:-1]))
        self._missing -= count
        if self._missing > 0:
            return False
        self._parts, self._missing = [], None
        return True


def run(host, port, requests, connections):
    """Sends each of the requests; their seconds, and those that all of it took. All have to be answered with 200, or
    with 304 where they say what they have."""
    seconds = []
    waiting = iter(requests)
    with selectors.DefaultSelector() as selector:
        wires = [_Wire(host, port) for _ in range(connections)]
        begin = time.perf_counter()

        def send_next(wire):
            request = next(waiting, None)
            if request is None:
                selector.unregister(wire.socket)
            else:
                wire.send(request)

        for wire in wires:
            selector.register(wire.socket, selectors.EVENT_READ, wire)
            send_next(wire)
        while selector.get_map():
            for key, _ in selector.select():
                wire = key.data
                if wire.receive():
                    seconds.append(time.perf_counter() - wire.began)
                    if wire.status not in (200, 304):
                        raise RuntimeError(f"answered with {wire.status}")
                    send_next(wire)
        took = time.perf_counter() - begin
        for wire in wires:
            wire.socket.close()
    return seconds, took
