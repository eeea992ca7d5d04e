# SPDX-License-Identifier: Apache-2.0
"""A running camera for asyncio."""
from __future__ import annotations

from typing import Any, AsyncIterator, Dict

from .aio_session import AsyncSession
from .camera import Frame, stream_fields
from .connection import Connection


class Camera(AsyncSession):
    """As obscura_client.Camera, made by connect_camera(); `calls` has what has no method of its own here. For the tasks of one
    event loop, each of which may read a stream.

        async with await obscura_client.aio.connect_camera("/run/obscura/calls") as camera:
            async for frame in camera.frames():
                await camera.set(ExposureTime=1e4 if frame.pixels.max() < 2000 else 5e3)
    """

    def __init__(self, connected: Connection, server: Dict[str, Any], timeout_s: float, camera: int) -> None:
        super().__init__(connected, server, timeout_s)
        self.camera = camera

    async def get(self, *names: str) -> Any:
        """The value of one setting; of several or all a dict."""
        values: Dict[str, Any] = (await self.call("camera.get", camera=self.camera, names=list(names) or None))["values"]
        return values[names[0]] if len(names) == 1 else values

    async def set(self, **values: Any) -> Dict[str, Any]:
        """Changes settings from the next frame on, all of them or none. Returns everything that has changed."""
        changed: Dict[str, Any] = (await self.call("camera.set", camera=self.camera, values=values))["changed"]
        return changed

    async def start(self) -> bool:
        """Starts the acquisition; False: it was running."""
        return bool((await self.call("camera.start", camera=self.camera))["started"])

    async def stop(self) -> bool:
        """Stops the acquisition; False: it was not running."""
        return bool((await self.call("camera.stop", camera=self.camera))["stopped"])

    async def trigger(self, wait: bool = True) -> Dict[str, Any]:
        """See obscura_client.Camera.trigger()."""
        return await self.call("camera.trigger", camera=self.camera, wait=wait)

    async def frame(self, after: int = 0, wait_s: float = 10, codec: str = "none") -> Frame:
        """The newest frame whose `number` is larger than `after`; raises RequestError if none comes in time."""
        head, arrays = await self._request("frame", {"camera": self.camera, "after": after, "wait_s": float(wait_s), "codec": codec})
        return Frame(head, arrays["pixels"])

    async def frames(self, wait_s: float = 10, codec: str = "none", *, every: int = 1, ahead: int = 0) -> AsyncIterator[Frame]:
        """The stream, see obscura_client.Camera.frames()."""
        stream = self._stream("stream", stream_fields(self.camera, wait_s, codec, every), ahead)
        try:
            async for head, arrays in stream:
                yield Frame(head, arrays["pixels"])
        finally:
            await stream.aclose()

    async def state(self) -> Dict[str, Any]:
        """What the daemon and all its cameras do: see docs/control.md."""
        return await self.call("state")
