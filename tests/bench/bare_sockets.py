# SPDX-License-Identifier: Apache-2.0
"""Bare sockets beside which clients of the rendering server are measured."""
import os
import socket
import tempfile
import threading

PICTURE = 4 << 20  # bytes of 1024 x 1024 float32


def receive(sock, buffer):
    """Fills the buffer."""
    view, at = memoryview(buffer), 0
    while at < len(buffer):
        at += sock.recv_into(view[at:])


class EchoServer:
    """Answers each 64 bytes of one client after the other: with the same, or with a picture if the first is not 0. In a `with`
    statement; `address`: "HOST:PORT", or the path of a Unix socket."""

    def __init__(self, family):
        self._family = family
        self._listener = socket.socket(family)
        self._listener.bind(("127.0.0.1", 0) if family == socket.AF_INET else tempfile.mktemp(prefix="obscura-bench-"))
        self._listener.listen(1)
        name = self._listener.getsockname()
        self.address = name if family == socket.AF_UNIX else "{}:{}".format(*name)
        threading.Thread(target=self._serve, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self._listener.close()
        if self._family == socket.AF_UNIX:
            os.unlink(self.address)

    def connect(self):
        """A client's socket."""
        client = socket.socket(self._family)
        client.connect(self._listener.getsockname())
        return client

    def _serve(self):
        asked, picture = bytearray(64), bytes(PICTURE)
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            with client:
                if self._family == socket.AF_INET:
                    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                while client.recv_into(asked) == len(asked):
                    client.sendall(picture if asked[0] else asked)
