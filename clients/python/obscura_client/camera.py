# SPDX-License-Identifier: Apache-2.0
"""A running camera: client of the daemon `obscurad`."""
from __future__ import annotations

import os
import pathlib
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Union

import numpy

from .png import png
from .protocol import Token
from .session import Session


class Frame:
    """One frame of a camera.

    pixels: uint16 [height, width], digital numbers below 2**bits, first row on top. `frame`: its number in the acquisition; `info`:
    the rest of the answer of the call `frame`. A notebook shows it with stretched contrast.
    """

    def __init__(self, head: Mapping[str, Any], pixels: numpy.ndarray[Any, Any]) -> None:
        self.pixels = pixels
        self.info = dict(head)
        self.number: int = head["number"]
        self.skipped: int = head["skipped"]
        self.frame: int = head["frame"]
        self.bits: int = head["bits"]

    def preview(self, gamma: float = 2.2) -> numpy.ndarray[Any, Any]:
        """uint8 [height, width] for looking at, from the 5th percentile to the 99.99th; not for measurement."""
        low, high = numpy.percentile(self.pixels, (5, 99.99))
        scaled = numpy.clip((self.pixels - low) / max(high - low, 1.0), 0, 1)
        return numpy.asarray(numpy.rint(255 * scaled ** (1 / gamma)), numpy.uint8)

    def save(self, file: Union[str, "os.PathLike[str]"]) -> pathlib.Path:
        """Writes a PNG for looking at, or with the ending .npy the digital numbers."""
        path = pathlib.Path(file)
        if path.suffix == ".npy":
            numpy.save(path, self.pixels)
        elif path.suffix == ".png":
            path.write_bytes(png(self.preview()))
        else:
            raise ValueError(f"{path}: the name must end in .png or .npy")
        return path

    def _repr_png_(self) -> bytes:
        return png(self.preview())

    def __repr__(self) -> str:
        height, width = self.pixels.shape
        return f"<Frame {self.frame}, {width} x {height} px, {self.bits} bit, {self.skipped} skipped before it>"


def stream_fields(camera: int, wait_s: float, codec: str, every: int) -> Dict[str, Any]:
    """Fields of the call stream."""
    return {"camera": camera, "wait_s": float(wait_s), "codec": codec, "every": every}


class Camera(Session):
    """A camera of a running daemon, which other programs see too. Settings have their SFNC names.

        with obscura_client.connect_camera("/run/obscura/calls") as camera:
            camera.set(ExposureTime=5000, TriggerSource="Software")
            print(camera.trigger()["outcome"])

    While a GigE Vision client controls the camera, what changes it raises RequestError with the code "controlled". `camera`: its
    number, in the order of the daemon's configuration.
    """

    def __init__(self, address: str, camera: int = 0, timeout_s: float = 90, token: Optional[Token] = None) -> None:
        super().__init__(address, timeout_s, token)
        self.camera = camera

    # Settings

    def features(self) -> List[Dict[str, Any]]:
        """The settings: name, value, type, unit, allowed, help; locked: cannot change during acquisition."""
        rows: List[Dict[str, Any]] = self.call("camera.features", camera=self.camera)["features"]
        return rows

    def get(self, *names: str) -> Any:
        """The value of one setting; of several or all a dict."""
        values: Dict[str, Any] = self.call("camera.get", camera=self.camera, names=list(names) or None)["values"]
        return values[names[0]] if len(names) == 1 else values

    def set(self, force: bool = False, **values: Any) -> Dict[str, Any]:
        """Changes settings from the next frame on, all of them or none. Returns everything that has changed. `force`: also while a
        GigE Vision client controls the camera (permission admin)."""
        changed: Dict[str, Any] = self.call("camera.set", camera=self.camera, values=values, force=force)["changed"]
        return changed

    # Frames

    def start(self) -> bool:
        """Starts the acquisition; False: it was running."""
        return bool(self.call("camera.start", camera=self.camera)["started"])

    def stop(self) -> bool:
        """Stops the acquisition; False: it was not running."""
        return bool(self.call("camera.stop", camera=self.camera)["stopped"])

    def trigger(self, wait: bool = True) -> Dict[str, Any]:
        """Triggers a frame (TriggerSource "Software"). With `wait` the answer has the frame's number, outcome and late rows."""
        return self.call("camera.trigger", camera=self.camera, wait=wait)

    def frame(self, after: int = 0, wait_s: float = 10, codec: str = "none") -> Frame:
        """The newest frame whose `number` is larger than `after`; raises RequestError if none comes in time."""
        head, arrays = self._connection.request("frame", {"camera": self.camera, "after": after, "wait_s": float(wait_s), "codec": codec})
        return Frame(head, arrays["pixels"])

    def frames(self, wait_s: float = 10, codec: str = "none", *, every: int = 1, ahead: int = 0) -> Iterator[Frame]:
        """The stream: each frame is the newest one when it is asked for, and says how many were skipped since the one before.

        every: 10 gives one frame of ten; ahead: further frames that may be on their way meanwhile, which then are older. Other
        calls work within the loop, which may be left at any time. Raises RequestError if no frame comes for `wait_s`."""
        fields = stream_fields(self.camera, wait_s, codec, every)
        for head, arrays in self._connection.stream("stream", fields, ahead):
            yield Frame(head, arrays["pixels"])

    def timing(self, after: int = 0, most: int = 64) -> Dict[str, Any]:
        """Time stamps of the newest frames: `columns`, `rows` (oldest first), `last`, which is `after` of the next request."""
        return self.call("timing", camera=self.camera, after=after, most=most)

    def timing_rows(self, frame: int = 0) -> Dict[str, Any]:
        """How late each row of a frame left: `lateness_us`, None for a row that did not leave. 0: the newest frame that has ended."""
        return self.call("timing.rows", camera=self.camera, frame=frame)

    def probe(self, x: int, y: int, frame: int = 0) -> Dict[str, Any]:
        """One pixel of the newest frame, or of a `frame` that is still kept: `dn`, `electrons`, `irradiance_w_m2` and of `bands`, and
        what its centre shows: `body`, `range_m`, latitude, longitude, incidence, emission and phase. The first one loads the scene."""
        return self.call("probe", camera=self.camera, x=x, y=y, frame=frame)

    def irradiance(self, frame: int = 0) -> Any:
        """Irradiance of all pixels of such a frame, W/m2 at the entrance pupil: an array [bands, height, width]. It is rendered again,
        which takes seconds."""
        _, arrays = self._connection.request("irradiance", {"camera": self.camera, "frame": frame})
        return arrays["irradiance"]

    # Faults

    def faults(self) -> List[Dict[str, Any]]:
        """The injected faults in force: the keys of [[gige.faults]], `origin`, and how often each has `struck`."""
        rules: List[Dict[str, Any]] = self.call("faults.list", camera=self.camera)["rules"]
        return rules

    def set_faults(self, *rules: Mapping[str, Any]) -> List[Dict[str, Any]]:
        """Replaces all injected faults, from the next frame on; without rules there are none. Returns what faults() does."""
        now: List[Dict[str, Any]] = self.call("faults.set", camera=self.camera, rules=[dict(rule) for rule in rules])["rules"]
        return now

    # Scene

    def scenes(self) -> List[str]:
        """Names that show_scene() takes."""
        names: List[str] = self.call("scene.list")["scenes"]
        return names

    def show_scene(self, file: str) -> None:
        """Shows another scene: a shipped one ("demo"), or a file below control.scenes. Returns once it is shown."""
        self.call("scene.show", file=file)

    def pose(self, name: str, time_s: float, position_m: Sequence[float], orientation: Sequence[float] = (1, 0, 0, 0), *,
             velocity_m_s: Optional[Sequence[float]] = None, rate_rad_s: Optional[Sequence[float]] = None) -> None:
        """Moves "camera", a body or a lamp; quaternion scalar first. With a velocity or a rate the motion goes on with both."""
        rates = velocity_m_s is not None or rate_rad_s is not None
        self.call("pose", camera=self.camera, name=name, time_s=time_s, position_m=list(position_m), orientation=list(orientation),
                  velocity_m_s=None if velocity_m_s is None else list(velocity_m_s),
                  rate_rad_s=None if rate_rad_s is None else list(rate_rad_s), rates=rates)

    def step(self, time_s: float) -> Dict[str, Any]:
        """Makes the frame of a scene time in lockstep (trigger.source = "lockstep"); answers when it has left."""
        return self.call("step", camera=self.camera, time_s=time_s)

    # Daemon

    def state(self) -> Dict[str, Any]:
        """What the daemon and all its cameras do: see docs/control.md."""
        return self.call("state")

    def configuration(self) -> Dict[str, Any]:
        """The configuration in use: `entries` with key, value (as TOML), unit, default, source; `file`; `sha256`."""
        return self.call("configuration")

    def events(self, after: int = 0) -> List[Dict[str, Any]]:
        """The latest lines of the daemon's log with ids above `after`: id, utc, level, text."""
        lines: List[Dict[str, Any]] = self.call("events", after=after)["events"]
        return lines


def connect_camera(address: str, camera: int = 0, timeout_s: float = 90, *, token: Optional[Token] = None) -> Camera:
    """Camera of a daemon with control.listen = "HOST:PORT", or control.unix_socket = PATH; `token`: the file of the token that
    it wants, or its 32 bytes. Raises ConnectionLost."""
    return Camera(address, camera, timeout_s, token)
