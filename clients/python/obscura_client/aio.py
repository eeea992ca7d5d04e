# SPDX-License-Identifier: Apache-2.0
"""The client for asyncio: as obscura_client.Client, with awaitable methods.

    async with await obscura_client.aio.connect("127.0.0.1:5152") as camera:
        await camera.load("demo")
        pictures = await asyncio.gather(*(camera.render(float(second), size=(512, 512)) for second in range(4)))

Requests may overlap; the server takes them one after the other. A task that is cancelled cancels its request.
"""
from __future__ import annotations

import asyncio
import socket
from typing import Any, Dict, List, Mapping, Optional, Tuple

import numpy

from . import messagepack, protocol
from .aio_calls import AsyncCalls
from .client import Item, render_fields
from .connection import Connection, Progress
from .errors import ConnectionLost, RequestError
from .picture import Picture
from .protocol import Arrays, Token

__all__ = ["Client", "connect"]


class _Request:
    """A request that has not been answered."""

    def __init__(self, progress: Optional[Progress]) -> None:
        self.answer: "asyncio.Future[Tuple[Dict[str, Any], Arrays]]" = asyncio.get_running_loop().create_future()
        self.progress = progress


class Client:
    """A connection and its scene, made by connect(). For the tasks of one event loop."""

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

    async def __aenter__(self) -> "Client":
        return self

    async def __aexit__(self, *_error: object) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"<obscura_client.aio.Client {self._address if self._socket else 'closed'}, server {self.server['version']}>"

    async def close(self) -> None:
        """Ends the connection; the scene is gone."""
        self._end("the connection is closed")
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def call(self, name: str, **fields: Any) -> Dict[str, Any]:
        """Any call of the server by its name (see describe()); fields that are None are left out."""
        return (await self._request(name, {key: value for key, value in fields.items() if value is not None}))[0]

    # Scene

    async def load(self, file: Optional[str] = None, *, toml: Optional[str] = None,
                   scene: Optional[Mapping[str, Any]] = None) -> List[str]:
        """See obscura_client.Client.load()."""
        bodies: List[str] = (await self.call("scene.load", file=file, toml=toml, scene=scene and dict(scene)))["bodies"]
        return bodies

    async def export(self) -> str:
        """The scene as a scene file."""
        text: str = (await self.call("scene.export"))["toml"]
        return text

    async def get(self, section: str, item: Optional[Item] = None) -> Any:
        """See obscura_client.Client.get()."""
        return (await self.call("scene.get", section=section, item=item))["keys"]

    async def set(self, section: str, item: Optional[Item] = None, /, **keys: Any) -> None:
        """Changes keys of a table or of an element; None removes a key."""
        await self.call("scene.set", section=section, item=item, keys=keys)

    async def add(self, section: str, /, **keys: Any) -> None:
        """Adds a body, a lamp, ..."""
        await self.call("scene.add", section=section, keys=keys)

    async def remove(self, section: str, item: Optional[Item] = None) -> None:
        """Removes a table or an element."""
        await self.call("scene.remove", section=section, item=item)

    # Pictures

    async def render(self, time_s: float = 0.0, *, progress: Optional[Progress] = None, **options: Any) -> Picture:
        """With the options of obscura_client.Client.render()."""
        options["codec"] = protocol.codec_for(options.get("codec"), self._is_local, self.server)
        return Picture(*await self._request("render", render_fields(time_s, **options), progress))

    # Server

    async def describe(self) -> Dict[str, Any]:
        """The table of calls (`calls`) and the tables and keys of scenes (`sections`)."""
        return await self.call("describe")

    async def status(self) -> Dict[str, Any]:
        """What the server does for this connection."""
        return await self.call("status")

    async def _request(self, call: str, fields: Dict[str, Any], progress: Optional[Progress] = None) -> Tuple[Dict[str, Any], Arrays]:
        if self._socket is None:
            raise ConnectionLost(f"{self._address}: the connection is closed")
        number, self._next = self._next, self._next % 0xFFFFFFFF + 1
        request = self._waiting[number] = _Request(progress)
        loop = asyncio.get_running_loop()
        asked = loop.time()
        try:
            self._out.put_nowait(protocol.request(number, call, fields))
            while not request.answer.done():
                left = max(asked, self._heard) + self._timeout_s - loop.time()
                if left <= 0:
                    self._end("no answer in time")
                await asyncio.wait({request.answer}, timeout=left)
            return request.answer.result()
        except asyncio.CancelledError:
            if not request.answer.done():
                self._cancel(number)
            raise
        finally:
            del self._waiting[number]

    def _cancel(self, number: int) -> None:
        if self._socket is not None:
            self._out.put_nowait(protocol.request(self._next, "cancel", {"request": number}))
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


async def connect(address: str = "127.0.0.1:5152", timeout_s: float = 600, *, token: Optional[Token] = None) -> Client:
    """Client of a server that runs, as obscura_client.connect(). Raises ConnectionLost."""

    def greeted() -> Tuple[Connection, Dict[str, Any]]:
        connection = Connection(address, timeout_s)
        try:
            return connection, connection.greet(token)
        except BaseException:
            connection.close()
            raise

    connection, server = await asyncio.get_running_loop().run_in_executor(None, greeted)
    return Client(connection, server, timeout_s)
