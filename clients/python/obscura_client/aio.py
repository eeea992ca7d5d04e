# SPDX-License-Identifier: Apache-2.0
"""The clients for asyncio: as obscura_client.Client and Camera, with awaitable methods.

    async with await obscura_client.aio.connect("127.0.0.1:5152") as camera:
        await camera.load("demo")
        pictures = await asyncio.gather(*(camera.render(float(second), size=(512, 512)) for second in range(4)))

Requests may overlap; the server takes them one after the other. A task that is cancelled cancels its request.
"""
from __future__ import annotations

from typing import Any, List, Mapping, Optional

from . import protocol
from .aio_camera import Camera
from .aio_session import AsyncSession, greeted
from .client import Item, render_fields
from .connection import Progress
from .picture import Picture
from .protocol import Token

__all__ = ["Camera", "Client", "connect", "connect_camera"]


class Client(AsyncSession):
    """A connection and its scene, made by connect(). For the tasks of one event loop."""

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


async def connect(address: str = "127.0.0.1:5152", timeout_s: float = 600, *, token: Optional[Token] = None) -> Client:
    """Client of a server that runs, as obscura_client.connect(). Raises ConnectionLost."""
    return Client(*await greeted(address, timeout_s, token), timeout_s)


async def connect_camera(address: str, camera: int = 0, timeout_s: float = 90, *, token: Optional[Token] = None) -> Camera:
    """Camera of a daemon, as obscura_client.connect_camera(). Raises ConnectionLost."""
    return Camera(*await greeted(address, timeout_s, token), timeout_s, camera)
