# SPDX-License-Identifier: Apache-2.0
"""A rendered picture."""
from __future__ import annotations

import copy
import os
import pathlib
import subprocess
import tempfile
from typing import Any, Dict, List, Mapping, Optional, Union

import numpy

from .errors import ObscuraError
from .memory import Place
from .png import png


class Picture:
    """Arrays of one picture, first row on top.

    values: float32 [bands, height, width], W/m2 per pixel at the entrance pupil (or W m-2 sr-1, see `unit`); of a sensor
    uint16 [height, width], digital numbers.
    layers: further arrays by name, float32 [height, width]. truth: poses, if they were asked for. detector: bits, window,
    exposure obtained and flags of the readout, of a sensor.
    A notebook shows it with stretched contrast. With shared memory (Client.share_memory()) the arrays are views of it until
    the server writes over them: see is_whole and copy().
    """

    def __init__(self, head: Mapping[str, Any], arrays: Dict[str, numpy.ndarray[Any, Any]], place: Optional[Place] = None) -> None:
        self._place = place
        names = list(arrays)
        self.quantity: str = names[0]
        self.values: numpy.ndarray[Any, Any] = arrays[names[0]]
        self.layers: Dict[str, numpy.ndarray[Any, Any]] = {name: arrays[name] for name in names[1:]}
        self.unit: str = head["unit"]
        self.bands_nm: List[List[float]] = head["bands_nm"]
        self.time_s: float = head["time_s"]
        self.seconds: float = head["seconds"]
        self.truth: Optional[Dict[str, Any]] = head.get("truth")
        self.detector: Optional[Dict[str, Any]] = head.get("detector")

    @property
    def is_whole(self) -> bool:
        """Whether what has been read of the arrays so far was this picture, and not a later one in the same place."""
        return self._place is None or self._place.is_whole

    def copy(self) -> "Picture":
        """A picture with arrays of its own. Raises ObscuraError if the server has written over these."""
        copied = copy.copy(self)
        copied.values = self.values.copy()
        copied.layers = {name: layer.copy() for name, layer in self.layers.items()}
        if not self.is_whole:
            raise ObscuraError("a later picture stands there; copy() comes before the request that overwrites it")
        copied._place = None
        return copied

    @property
    def depth_m(self) -> numpy.ndarray[Any, Any]:
        """Range along the boresight, NaN where nothing is; rendered with layers=["depth_m"]."""
        return self.layers["depth_m"]

    @property
    def normals(self) -> numpy.ndarray[Any, Any]:
        """Unit normals [height, width, 3] in inertial axes; rendered with the layers normal.x, normal.y and normal.z."""
        return numpy.stack([self.layers[f"normal.{axis}"] for axis in "xyz"], axis=-1)

    def preview(self, layer: Optional[str] = None, gamma: float = 2.2) -> numpy.ndarray[Any, Any]:
        """uint8 [height, width] for looking at: from the darkest value to the 99.9th percentile of those that are lit; not
        for measurement."""
        height, width = self.values.shape[-2:]
        image = self.values.reshape(-1, height, width).mean(axis=0) if layer is None else self.layers[layer]
        seen = image[numpy.isfinite(image) & (image != 0)]
        if seen.size == 0:
            return numpy.zeros(image.shape, numpy.uint8)
        low = 0.0 if layer is None else float(seen.min())
        high = float(numpy.percentile(seen, 99.9)) if layer is None else float(seen.max())
        scaled = numpy.clip((numpy.nan_to_num(image, nan=low) - low) / max(high - low, 1e-300), 0, 1)
        return numpy.asarray(numpy.rint(255 * scaled ** (1 / gamma)), numpy.uint8)

    def save(self, file: Union[str, "os.PathLike[str]"], layer: Optional[str] = None) -> pathlib.Path:
        """Writes a PNG for looking at, or with the ending .npz all arrays."""
        path = pathlib.Path(file)
        if path.suffix == ".npz":
            numpy.savez_compressed(path, **{self.quantity: self.values}, **self.layers)
        elif path.suffix == ".png":
            path.write_bytes(png(self.preview(layer)))
        else:
            raise ValueError(f"{path}: the name must end in .png or .npz")
        return path

    def show(self, layer: Optional[str] = None) -> pathlib.Path:
        """Opens the picture in the desktop's viewer, where there is one; returns its file."""
        handle, name = tempfile.mkstemp(prefix="obscura-", suffix=".png")
        os.close(handle)
        path = self.save(name, layer)
        try:
            subprocess.Popen(["xdg-open", name], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        except OSError:
            print(path)
        return path

    def _repr_png_(self) -> bytes:
        return png(self.preview())

    def __repr__(self) -> str:
        height, width = self.values.shape[-2:]
        layers = f", layers {', '.join(self.layers)}" if self.layers else ""
        bands = len(self.bands_nm)
        return (f"<Picture {width} x {height} px, {bands} band{'s' if bands > 1 else ''}, {self.quantity} up to "
                f"{float(self.values.max()):.4g} {self.unit}, at {self.time_s:g} s{layers}>")
