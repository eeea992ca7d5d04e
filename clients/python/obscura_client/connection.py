# SPDX-License-Identifier: Apache-2.0
"""Native protocol: messages of a frame of 24 bytes, a MessagePack head and raw arrays."""
from __future__ import annotations

import socket
import struct
from typing import Any, Callable, Dict, Optional, Tuple

import numpy

from . import messagepack
from .errors import ConnectionLost, RequestError

Progress = Callable[[int, int, Optional[float]], None]
Arrays = Dict[str, numpy.ndarray]

_FRAME = struct.Struct("<4sBBHIIQ")
_MAGIC, _VERSION = b"OBSC", 1
_REQUEST, _ANSWER, _EVENT, _ERROR = 1, 2, 3, 4


def _open(address: str, timeout_s: float) -> socket.socket:
    """A connected socket; `address`: "HOST:PORT", or the path of a Unix socket, which has a "/"."""
    try:
        if "/" in address:
            sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            sock.settimeout(timeout_s)
            sock.connect(address)
            return sock
        host, _, port = address.rpartition(":")
        sock = socket.create_connection((host, int(port)), timeout_s)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return sock
    except (OSError, ValueError) as error:
        raise ConnectionLost(f"{address}: {error} (is `obscura serve` running there?)") from None


class Connection:
    """One connection, requests one after the other. Not for several threads."""

    def __init__(self, address: str, timeout_s: float) -> None:
        self.address = address
        self._socket: Optional[socket.socket] = _open(address, timeout_s)
        self._next = 1
        self._current = 0  # number of the request in progress
        self._interrupted = False  # it was cancelled by Ctrl-C
        self._whole = True  # no message has been read in part

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    @property
    def is_open(self) -> bool:
        return self._socket is not None

    def request(self, call: str, fields: Dict[str, Any], progress: Optional[Progress] = None) -> Tuple[Dict[str, Any], Arrays]:
        """Head and arrays of the answer. Ctrl-C cancels the request at the server and keeps the connection.

        Raises RequestError for an error answer, ConnectionLost if there is none."""
        number = self._current = self._send(call, fields)
        self._interrupted = False
        try:
            answer = self._receive(number, progress)
        except RequestError:
            if self._interrupted:
                raise KeyboardInterrupt from None
            raise
        except KeyboardInterrupt:  # of the progress function, or between two reads
            if not self._whole:
                self.close()
            if self._socket is not None and not self._interrupted:
                self._send("cancel", {"request": number})
                try:
                    self._receive(number, None)
                except RequestError:
                    pass
            raise
        if self._interrupted:
            raise KeyboardInterrupt
        return answer

    def _send(self, call: str, fields: Dict[str, Any]) -> int:
        if self._socket is None:
            raise ConnectionLost(f"{self.address}: the connection is closed")
        head = messagepack.pack({"call": call, **fields})
        number, self._next = self._next, self._next % 0xFFFFFFFF + 1
        try:
            self._socket.sendall(_FRAME.pack(_MAGIC, _VERSION, _REQUEST, 0, number, len(head), 0) + head)
        except ConnectionError:
            pass  # there may be an error message to be read
        except OSError as error:
            self.close()
            raise ConnectionLost(f"{self.address}: {error}") from None
        return number

    def _receive(self, number: int, progress: Optional[Progress]) -> Tuple[Dict[str, Any], Arrays]:
        while True:
            frame = self._read(_FRAME.size)
            self._whole = False
            magic, version, kind, _flags, of, head_bytes, body_bytes = _FRAME.unpack(frame)
            if magic != _MAGIC or version != _VERSION:
                self.close()
                raise ConnectionLost(f"{self.address}: the server does not speak this protocol")
            try:
                head = messagepack.unpack(self._read(head_bytes))
            except ValueError as error:
                self.close()
                raise ConnectionLost(f"{self.address}: {error}") from None
            body = self._read(body_bytes)
            self._whole = True
            if kind == _ERROR and of in (0, number):
                if of == 0:  # of the connection as a whole
                    self.close()
                raise RequestError(head)
            if of != number:
                continue  # of a request that was given up
            if kind == _EVENT and progress is not None and head.get("event") == "progress":
                progress(head["done"], head["total"], head.get("left_s"))
            if kind == _ANSWER:
                arrays = {row["name"]: body[row["offset"]:row["offset"] + row["bytes"]].view(row["dtype"]).reshape(row["shape"])
                          for row in head.pop("arrays", ())}
                return head, arrays

    def _read(self, count: int) -> numpy.ndarray:
        """The next bytes, in a buffer of their own: arrays are views of it."""
        if self._socket is None:
            raise ConnectionLost(f"{self.address}: the connection is closed")
        buffer = numpy.empty(count, numpy.uint8)
        view, at = memoryview(buffer), 0
        while at < count:
            try:
                got = self._socket.recv_into(view[at:])
            except KeyboardInterrupt:
                if self._interrupted:
                    self.close()
                    raise
                self._interrupted = True
                self._send("cancel", {"request": self._current})
                continue
            except socket.timeout:
                self.close()
                raise ConnectionLost(f"{self.address}: no answer in time") from None
            except OSError as error:
                self.close()
                raise ConnectionLost(f"{self.address}: {error}") from None
            if got == 0:
                self.close()
                raise ConnectionLost(f"{self.address}: the server has ended the connection")
            at += got
        return buffer
