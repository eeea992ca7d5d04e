# SPDX-License-Identifier: Apache-2.0
"""Client of a rendering server: one scene, which only this client sees."""
from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from . import protocol
from .connection import Progress
from .picture import Picture
from .protocol import Token
from .session import Session

Item = Union[str, int]


def render_fields(time_s: float, *, size: Optional[Tuple[int, int]] = None, layers: Optional[Sequence[str]] = None,
                  sensor: Optional[Union[str, Mapping[str, Any]]] = None, codec: str = "none", **plain: Any) -> Dict[str, Any]:
    """Fields of the call render; what is None, or a codec of none, is left out."""
    fields: Dict[str, Any] = {"time_s": float(time_s), "layers": None if layers is None else list(layers),
                              "sensor": dict(sensor) if isinstance(sensor, Mapping) else sensor,
                              "codec": None if codec == "none" else codec, **plain}
    if size is not None:
        fields["width"], fields["height"] = size
    return {name: value for name, value in fields.items() if value is not None}


class Client(Session):
    """A connection and its scene. Use it in a `with` statement, or call close().

    Names and units of keys are those of scene files (docs/reference/scene.md, `obscura keys`). Waits at most `timeout_s`
    for news from the server. Not for several threads at once.
    """

    # Scene

    def load(self, file: Optional[str] = None, *, toml: Optional[str] = None, scene: Optional[Mapping[str, Any]] = None) -> List[str]:
        """Replaces the scene by a shipped one ("demo"), by a file below the server's folder, by the text of a scene file or
        by its tables as a dict. Returns the names of the bodies."""
        bodies: List[str] = self.call("scene.load", file=file, toml=toml, scene=None if scene is None else dict(scene))["bodies"]
        return bodies

    def export(self) -> str:
        """The scene as a scene file; `obscura render` makes the same picture of it."""
        text: str = self.call("scene.export")["toml"]
        return text

    def get(self, section: str, item: Optional[Item] = None) -> Any:
        """Keys that a table gives ("camera", "sun", "stars", "scene"), or an element of "body", "lamp", ..."""
        return self.call("scene.get", section=section, item=item)["keys"]

    def set(self, section: str, item: Optional[Item] = None, /, **keys: Any) -> None:
        """Changes keys of a table or of an element; None removes a key."""
        self.call("scene.set", section=section, item=item, keys=keys)

    def add(self, section: str, /, **keys: Any) -> None:
        """Adds a body, a lamp, ..."""
        self.call("scene.add", section=section, keys=keys)

    def remove(self, section: str, item: Optional[Item] = None) -> None:
        """Removes a table or an element."""
        self.call("scene.remove", section=section, item=item)

    # Pictures

    def render(
        self,
        time_s: float = 0.0,
        *,
        exposure_s: Optional[float] = None,
        size: Optional[Tuple[int, int]] = None,
        window: Optional[Tuple[int, int, int, int]] = None,
        samples: Optional[int] = None,
        error: Optional[float] = None,
        max_samples: Optional[int] = None,
        bounces: Optional[int] = None,
        seed: Optional[int] = None,
        frame: Optional[int] = None,
        layers: Optional[Sequence[str]] = None,
        truth: bool = False,
        sensor: Optional[Union[str, Mapping[str, Any]]] = None,
        gain_db: Optional[float] = None,
        run: Optional[int] = None,
        codec: Optional[str] = None,
        progress: Optional[Progress] = None,
    ) -> Picture:
        """Renders the scene at a scene time. `size`: width and height; `window`: column, row, width, height; `layers`: see
        Picture; `sensor`: name of a sensor, or its keys, for digital numbers instead of light, with `exposure_s`;
        `progress(done_rows, rows, seconds_left)` is called up to five times a second. What is None has the server's default;
        `codec`: "none" for a server on this machine, else what can be read here. Ctrl-C cancels."""
        codec = protocol.codec_for(codec, self._connection.is_local, self.server)
        fields = render_fields(time_s, exposure_s=exposure_s, size=size, window=window, samples=samples, error=error,
                               max_samples=max_samples, bounces=bounces, seed=seed, frame=frame, layers=layers, truth=truth,
                               sensor=sensor, gain_db=gain_db, run=run, codec=codec)
        head, arrays = self._connection.request("render", fields, progress)
        return Picture(head, arrays, self._connection.place)

    # Server

    def share_memory(self, pictures: int = 4, mib: float = 64) -> None:
        """From now on pictures stand in memory that the server shares, `pictures` of at most `mib` MiB at a time, and their
        arrays are views of it: each overwrites the oldest. Over a Unix socket only, as of start()."""
        self._connection.share_memory(pictures, int(mib * (1 << 20)))


def connect(address: str = "127.0.0.1:5152", timeout_s: float = 600, *, token: Optional[Token] = None) -> Client:
    """Client of a server that runs: "HOST:PORT", or the path of its Unix socket; `token`: the file of the token that the
    server wants, or its 32 bytes. Raises ConnectionLost."""
    return Client(address, timeout_s, token)
