# SPDX-License-Identifier: Apache-2.0
"""Connection to a server of the native protocol for asyncio, whatever calls it has."""
from __future__ import annotations

import asyncio
import socket
from collections import deque
from typing import Any, AsyncGenerator, Deque, Dict, Optional, Tuple, TypeVar

import numpy

from . import messagepack, protocol
from .aio_calls import AsyncCalls
from .connection import Connection, Progress
from .errors import ConnectionLost, RequestError
from .protocol import Arrays, Token

Self = TypeVar("Self", bound="AsyncSession")


class _Request:
    """A request that has not been answered."""

    def __init__(self, progress: Optional[Progress]) -> None:
        self.answer: "asyncio.Future[Tuple[Dict[str, Any], Arrays]]" = asyncio.get_running_loop().create_future()
        self.progress = progress
        self.frames: Deque[Tuple[Dict[str, Any], Arrays]] = deque()  # of a stream, not taken yet
        self.news: "Optional[asyncio.Future[None]]" = None  # done when one has come


class AsyncSession:
    """A connection, made by connect() or connect_camera(). For the tasks of one event loop."""

    def __init__(self, connected: Connection, server: Dict[str, Any], timeout_s: float) -> None:
        self.server = server
        self.calls = AsyncCalls(self._request)  # each call of the server, with types
        self._address, self._is_local, self._timeout_s = connected.address, connected.is_local, timeout_s
        self._socket: Optional[socket.socket] = connected.detach()
        self._next = 1 << 16  # beyond what has been used
        self._waiting: Dict[int, _Request] = {}
        self._heard = asyncio.get_running_loop().time()
        self._out: "asyncio.Queue[bytes]" = asyncio.Queue()
        self._tasks = [asyncio.create_task(self._run(self._write())), asyncio.create_task(self._run(self._read()))]

    async def __aenter__(self: Self) -> Self:
        return self

    async def __aexit__(self, *_error: object) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"<obscura_client.aio.{type(self).__name__} {self._address if self._socket else 'closed'}, server {self.server['version']}>"

    async def close(self) -> None:
        """Ends the connection, and what the server keeps for it."""
        self._end("the connection is closed")
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def call(self, name: str, **fields: Any) -> Dict[str, Any]:
        """Any call of the server by its name (see describe()); fields that are None are left out."""
        return (await self._request(name, {key: value for key, value in fields.items() if value is not None}))[0]

    async def describe(self) -> Dict[str, Any]:
        """The table of calls (`calls`); of a rendering server the tables and keys of scenes (`sections`), too."""
        return await self.call("describe")

    async def status(self) -> Dict[str, Any]:
        """What the server does for this connection."""
        return await self.call("status")

    async def _request(self, call: str, fields: Dict[str, Any], progress: Optional[Progress] = None) -> Tuple[Dict[str, Any], Arrays]:
        if self._socket is None:
            raise ConnectionLost(f"{self._address}: the connection is closed")
        number, self._next = self._next, self._next % 0xFFFFFFFF + 1
        request = self._waiting[number] = _Request(progress)
        try:
            self._out.put_nowait(protocol.request(number, call, fields))
            await self._news(request.answer)
            return request.answer.result()
        except asyncio.CancelledError:
            if not request.answer.done():
                self._cancel(number)
            raise
        finally:
            del self._waiting[number]

    async def _stream(self, call: str, fields: Dict[str, Any], ahead: int) -> AsyncGenerator[Tuple[Dict[str, Any], Arrays], None]:
        """See Connection.stream()."""
        if self._socket is None:
            raise ConnectionLost(f"{self._address}: the connection is closed")
        number, self._next = self._next, self._next % 0xFFFFFFFF + 1
        request = self._waiting[number] = _Request(None)
        try:
            self._out.put_nowait(protocol.request(number, call, {**fields, "credits": 1 + ahead}))
            while True:
                if not request.frames and not request.answer.done():
                    request.news = asyncio.get_running_loop().create_future()
                    await self._news(request.answer, request.news)
                if request.frames:
                    yield request.frames.popleft()
                    self._tell("credit", {"request": number})
                elif request.answer.done():
                    request.answer.result()
                    return
        finally:
            if not request.answer.done():
                self._cancel(number)
            elif not request.answer.cancelled():
                request.answer.exception()  # it has been told, or is no more wanted
            del self._waiting[number]

    async def _news(self, *futures: "asyncio.Future[Any]") -> None:
        """Waits until one of them is done, or ends the connection once the server has been silent for too long."""
        loop = asyncio.get_running_loop()
        asked = loop.time()
        while not any(future.done() for future in futures):
            left = max(asked, self._heard) + self._timeout_s - loop.time()
            if left <= 0:
                self._end("no answer in time")
            await asyncio.wait(futures, timeout=left, return_when=asyncio.FIRST_COMPLETED)

    def _cancel(self, number: int) -> None:
        self._tell("cancel", {"request": number})

    def _tell(self, call: str, fields: Dict[str, Any]) -> None:
        """Sends a request without waiting for its answer."""
        if self._socket is not None:
            self._out.put_nowait(protocol.request(self._next, call, fields))
            self._next = self._next % 0xFFFFFFFF + 1

    async def _run(self, work: Any) -> None:
        try:
            await work
        except (OSError, ValueError, ConnectionLost) as error:
            self._end(str(error))

    def _end(self, why: str) -> None:
        if self._socket is None:
            return
        for task in self._tasks:
            task.cancel()
        self._socket.close()
        self._socket = None
        for request in self._waiting.values():
            if not request.answer.done():
                request.answer.set_exception(ConnectionLost(f"{self._address}: {why}"))

    async def _write(self) -> None:
        loop = asyncio.get_running_loop()
        while self._socket is not None:
            await loop.sock_sendall(self._socket, await self._out.get())

    async def _read(self) -> None:
        while True:
            frame = protocol.frame((await self._bytes(protocol.FRAME_BYTES)).data)
            head = messagepack.unpack((await self._bytes(frame.head_bytes)).data)
            body = await self._bytes(frame.body_bytes)
            self._heard = asyncio.get_running_loop().time()
            if frame.kind == protocol.ERROR and frame.number == 0:
                raise ConnectionLost(RequestError(head).message)
            request = self._waiting.get(frame.number)
            if request is None or request.answer.done():
                continue  # of a task that was cancelled
            if frame.kind == protocol.ERROR:
                request.answer.set_exception(RequestError(head))
            elif frame.kind == protocol.EVENT and request.progress is not None and head.get("event") == "progress":
                try:
                    request.progress(head["done"], head["total"], head.get("left_s"))
                except Exception as error:  # is that of the task that asked
                    request.answer.set_exception(error)
                    self._cancel(frame.number)
            elif frame.kind == protocol.EVENT and head.get("event") == "frame":
                request.frames.append((head, protocol.arrays(head, body)))
                if request.news is not None and not request.news.done():
                    request.news.set_result(None)
            elif frame.kind == protocol.ANSWER:
                request.answer.set_result((head, protocol.arrays(head, body)))

    async def _bytes(self, count: int) -> numpy.ndarray[Any, Any]:
        """The next bytes, in a buffer of their own: arrays are views of it."""
        loop = asyncio.get_running_loop()
        buffer = numpy.empty(count, numpy.uint8)
        view, at = buffer.data, 0
        while at < count:
            got = 0 if self._socket is None else await loop.sock_recv_into(self._socket, view[at:])
            if got == 0:
                raise ConnectionLost("the server has ended the connection")
            at += got
        return buffer


async def greeted(address: str, timeout_s: float, token: Optional[Token]) -> Tuple[Connection, Dict[str, Any]]:
    """A connection, and what its server says of itself. Raises ConnectionLost."""

    def greet() -> Tuple[Connection, Dict[str, Any]]:
        connection = Connection(address, timeout_s)
        try:
            return connection, connection.greet(token)
        except BaseException:
            connection.close()
            raise

    return await asyncio.get_running_loop().run_in_executor(None, greet)
