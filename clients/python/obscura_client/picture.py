# SPDX-License-Identifier: Apache-2.0
"""A rendered picture."""
from __future__ import annotations

import os
import pathlib
import subprocess
import tempfile
from typing import Any, Dict, List, Mapping, Optional, Union

import numpy

from .png import png


class Picture:
    """Arrays of one picture, first row on top.

    values: float32 [bands, height, width], W/m2 per pixel at the entrance pupil (or W m-2 sr-1, see `unit`).
    layers: further arrays by name, float32 [height, width]. truth: poses, if they were asked for.
    A notebook shows it with stretched contrast.
    """

    def __init__(self, head: Mapping[str, Any], arrays: Dict[str, numpy.ndarray]) -> None:
        names = list(arrays)
        self.quantity: str = names[0]
        self.values: numpy.ndarray = arrays[names[0]]
        self.layers: Dict[str, numpy.ndarray] = {name: arrays[name] for name in names[1:]}
        self.unit: str = head["unit"]
        self.bands_nm: List[List[float]] = head["bands_nm"]
        self.time_s: float = head["time_s"]
        self.seconds: float = head["seconds"]
        self.truth: Optional[Dict[str, Any]] = head.get("truth")

    @property
    def depth_m(self) -> numpy.ndarray:
        """Range along the boresight, NaN where nothing is; rendered with layers=["depth_m"]."""
        return self.layers["depth_m"]

    @property
    def normals(self) -> numpy.ndarray:
        """Unit normals [height, width, 3] in inertial axes; rendered with the layers normal.x, normal.y and normal.z."""
        return numpy.stack([self.layers[f"normal.{axis}"] for axis in "xyz"], axis=-1)

    def preview(self, layer: Optional[str] = None, gamma: float = 2.2) -> numpy.ndarray:
        """uint8 [height, width] for looking at: from the darkest value to the 99.9th percentile of those that are lit; not
        for measurement."""
        image = self.values.mean(axis=0) if layer is None else self.layers[layer]
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
        bands, height, width = self.values.shape
        layers = f", layers {', '.join(self.layers)}" if self.layers else ""
        return (f"<Picture {width} x {height} px, {bands} band{'s' if bands > 1 else ''}, {self.quantity} up to "
                f"{float(self.values.max()):.4g} {self.unit}, at {self.time_s:g} s{layers}>")
