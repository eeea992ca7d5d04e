# SPDX-License-Identifier: Apache-2.0
"""One connection to a server: requests one after the other."""
from __future__ import annotations

import array
import os
import socket
from collections import deque
from typing import Any, Callable, Deque, Dict, Iterator, List, Optional, Tuple, Union

import numpy

from . import messagepack, protocol
from .errors import ConnectionLost, RequestError
from .memory import Place, SharedMemory
from .protocol import Arrays

Progress = Callable[[int, int, Optional[float]], None]
Item = Union[Tuple[Dict[str, Any], Arrays], RequestError, None]  # of a stream: a frame, or its end


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
        self._descriptors: List[int] = []  # that came with the answers since they were taken
        self._streams: Dict[int, Deque[Item]] = {}  # by the number of the request: what has come and was not taken
        self.memory: Optional[SharedMemory] = None
        self.place: Optional[Place] = None  # of the arrays of the last answer; None: they are its own

    def share_memory(self, slots: int, slot_bytes: int) -> None:
        """From now on arrays of answers stand in shared memory where they fit."""
        answer = self.request("memory.open", {"slots": slots, "bytes": slot_bytes})[0]
        descriptors = self.take_descriptors()
        if len(descriptors) != 1:
            raise ConnectionLost(f"{self.address}: the server has sent no memory")
        self.memory = SharedMemory(descriptors[0], answer)

    def take_descriptors(self) -> List[int]:
        """Files that a server of this machine has handed over with its last answer, such as that of the call `ring`. The caller
        closes them."""
        descriptors, self._descriptors = self._descriptors, []
        return descriptors

    def close(self) -> None:
        self._close_descriptors()
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _close_descriptors(self) -> None:
        for descriptor in self.take_descriptors():
            os.close(descriptor)

    def detach(self) -> socket.socket:
        """Gives the socket away, non-blocking."""
        if self._socket is None:
            raise ConnectionLost(f"{self.address}: the connection is closed")
        sock, self._socket = self._socket, None
        sock.setblocking(False)
        return sock

    @property
    def is_open(self) -> bool:
        return self._socket is not None

    @property
    def is_local(self) -> bool:
        """Whether the server is on this machine, so that compressing arrays costs more than it saves."""
        return self._socket is None or self._socket.family == socket.AF_UNIX or self._socket.getpeername()[0].startswith("127.")

    def greet(self, token: Optional[protocol.Token]) -> Dict[str, Any]:
        """The answer of hello."""
        fields = protocol.hello_fields()
        if token is not None:
            fields["proof"] = protocol.proof(token, self.request("challenge", {})[0]["challenge"])
        return self.request("hello", fields)[0]

    def request(self, call: str, fields: Dict[str, Any], progress: Optional[Progress] = None) -> Tuple[Dict[str, Any], Arrays]:
        """Head and arrays of the answer. Ctrl-C cancels the request at the server and keeps the connection.

        Raises RequestError for an error answer, ConnectionLost if there is none."""
        self._close_descriptors()
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

    def stream(self, call: str, fields: Dict[str, Any], ahead: int) -> Iterator[Tuple[Dict[str, Any], Arrays]]:
        """Heads and arrays of the frames of a stream. A frame that is taken grants the next; `ahead` further ones may be on their
        way. Closing the generator, and Ctrl-C, end the stream, not the connection."""
        number = self._send(call, {**fields, "credits": 1 + ahead})
        items = self._streams[number] = deque()
        ended = False
        try:
            while True:
                self._current, self._interrupted = number, False
                while not items:
                    self._take()
                item = items.popleft()
                ended = item is None or isinstance(item, RequestError)
                if self._interrupted:
                    raise KeyboardInterrupt
                if isinstance(item, RequestError):
                    raise item
                if item is None:
                    return
                yield item
                self._send("credit", {"request": number})
        finally:
            del self._streams[number]
            if not ended and self._socket is not None:
                self._send("cancel", {"request": number})

    def _send(self, call: str, fields: Dict[str, Any]) -> int:
        if self._socket is None:
            raise ConnectionLost(f"{self.address}: the connection is closed")
        number, self._next = self._next, self._next % 0xFFFFFFFF + 1
        message = protocol.request(number, call, fields)
        try:
            self._socket.sendall(message)
        except ConnectionError:
            pass  # there may be an error message to be read
        except OSError as error:
            self.close()
            raise ConnectionLost(f"{self.address}: {error}") from None
        return number

    def _receive(self, number: int, progress: Optional[Progress]) -> Tuple[Dict[str, Any], Arrays]:
        while True:
            frame, head, body = self._take()
            if frame.kind == protocol.ERROR and frame.number == number:
                raise RequestError(head)
            if frame.number != number:
                continue  # of a request that was given up, or of a stream
            if frame.kind == protocol.EVENT and progress is not None and head.get("event") == "progress":
                progress(head["done"], head["total"], head.get("left_s"))
            if frame.kind == protocol.ANSWER:
                return head, self._arrays(head, body)

    def _arrays(self, head: Dict[str, Any], body: numpy.ndarray[Any, Any]) -> Arrays:
        row = head.pop("memory", None)
        self.place = None if row is None or self.memory is None else Place(self.memory, row)
        return protocol.arrays(head, body if self.place is None else self.place.body())

    def _take(self) -> Tuple[protocol.Frame, Dict[str, Any], numpy.ndarray[Any, Any]]:
        """The next message; those of streams are kept for them, too."""
        data = self._read(protocol.FRAME_BYTES)
        self._whole = False
        try:
            frame = protocol.frame(data.data)
            head = messagepack.unpack(self._read(frame.head_bytes).data)
        except ValueError as error:
            self.close()
            raise ConnectionLost(f"{self.address}: {error}") from None
        body = self._read(frame.body_bytes)
        self._whole = True
        if frame.kind == protocol.ERROR and frame.number == 0:  # of the connection as a whole
            self.close()
            raise RequestError(head)
        items = self._streams.get(frame.number)
        if items is not None:
            if frame.kind == protocol.EVENT and head.get("event") == "frame":
                items.append((head, self._arrays(head, body)))
            elif frame.kind != protocol.EVENT:
                items.append(RequestError(head) if frame.kind == protocol.ERROR else None)
        return frame, head, body

    def _receive_into(self, view: memoryview) -> int:
        assert self._socket is not None
        if self._socket.family != socket.AF_UNIX:
            return self._socket.recv_into(view)
        got, rights, _flags, _from = self._socket.recvmsg_into([view], socket.CMSG_SPACE(4 * protocol.MAX_DESCRIPTORS))
        for level, kind, data in rights:
            if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
                self._descriptors += array.array("i", data[:len(data) - len(data) % 4])
        return got

    def _read(self, count: int) -> numpy.ndarray[Any, Any]:
        """The next bytes, in a buffer of their own: arrays are views of it."""
        if self._socket is None:
            raise ConnectionLost(f"{self.address}: the connection is closed")
        buffer = numpy.empty(count, numpy.uint8)
        view, at = buffer.data, 0
        while at < count:
            try:
                got = self._receive_into(view[at:])
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
