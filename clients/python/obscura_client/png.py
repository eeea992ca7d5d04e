# SPDX-License-Identifier: Apache-2.0
"""Writer of 8-bit PNG pictures."""
from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy


def png(pixels: numpy.ndarray[Any, Any]) -> bytes:
    """The picture as a PNG file; `pixels`: uint8 [height, width] or [height, width, 3]."""
    height, width = pixels.shape[:2]
    colour = 2 if pixels.ndim == 3 else 0
    rows = numpy.zeros((height, 1 + pixels[0].size), numpy.uint8)  # a zero before each row: no filter
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b""))
