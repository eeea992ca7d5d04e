#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes rock.obj, a cratered rock of about 200 m with texture coordinates, and rock.png, the map of its albedo.
Usage: make_rock.py [FOLDER]

A start for your own: any program that writes OBJ, STL, PLY, 3DS, Collada or glTF does. Units of the mesh are metres.
"""
import math
import pathlib
import random
import struct
import sys
import zlib

COLUMNS, ROWS = 64, 32  # facets along longitude and latitude
WIDTH, HEIGHT = 192, 96  # texels


def unit(longitude, latitude):
    return (math.cos(latitude) * math.cos(longitude), math.cos(latitude) * math.sin(longitude), math.sin(latitude))


def angle(a, b):
    """Angle between unit vectors, as their distance: good to 1 % below 30 degrees."""
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


def random_directions(seed, count):
    draw = random.Random(seed)
    return [(unit(draw.uniform(-math.pi, math.pi), math.asin(draw.uniform(-1, 1))), draw.random()) for _ in range(count)]


WAVES = random_directions(1, 12)
CRATERS = random_directions(2, 14)
SPOTS = random_directions(3, 90)


def radius_m(n):
    """Distance of the surface from the centre in the direction n: an ellipsoid, waves, bowls with rims."""
    r = 1 / math.sqrt((n[0] / 120) ** 2 + (n[1] / 95) ** 2 + (n[2] / 80) ** 2)
    for k, (direction, phase) in enumerate(WAVES):
        r += 12 / (k + 2) * math.sin((k + 2) * sum(x * y for x, y in zip(n, direction)) + 6 * phase)
    for direction, size in CRATERS:
        x = angle(n, direction) / (0.12 + 0.3 * size ** 2)
        r += 9 * (0.3 + size) * (x * x - 1 if x < 1 else 0) + 2 * math.exp(-(((x - 1) / 0.3) ** 2))
    return r


def albedo(n):
    """Factor on the reflectance: bright crater floors, mottled ground, dark and bright spots."""
    value = 0.7
    for direction, size in CRATERS[::3]:
        value += 0.2 * math.exp(-((angle(n, direction) / (0.15 + 0.3 * size ** 2)) ** 4))
    for k, (direction, phase) in enumerate(WAVES):
        value += 0.06 * math.sin((4 + 2 * k) * sum(x * y for x, y in zip(n, direction)) + 6 * phase)
    for direction, tone in SPOTS:
        value += (tone - 0.6) * 0.9 * math.exp(-((angle(n, direction) / (0.03 + 0.06 * tone)) ** 2))
    return max(0.2, min(1.0, value))


def obj():
    lines = ["# A rock, made by make_rock.py; metres"]
    for j in range(ROWS + 1):
        for i in range(COLUMNS + 1):  # the first meridian twice: once with u = 0, once with u = 1
            n = unit(2 * math.pi * (i % COLUMNS) / COLUMNS - math.pi, math.pi / 2 - math.pi * j / ROWS)
            r = radius_m(n)
            lines.append("v " + " ".join(f"{r * x:.2f}" for x in n))
            lines.append(f"vt {i / COLUMNS:.6g} {1 - j / ROWS:.6g}")
    for j in range(ROWS):
        for i in range(COLUMNS):
            a = j * (COLUMNS + 1) + i + 1
            b, c, d = a + COLUMNS + 1, a + COLUMNS + 2, a + 1
            for face in ((a, b, c),) * (j < ROWS - 1) + ((a, c, d),) * (j > 0):
                lines.append("f " + " ".join(f"{k}/{k}" for k in face))
    return "\n".join(lines) + "\n"


def png(rows):
    """8-bit grey PNG."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def texture():
    def direction(i, j):
        return unit(2 * math.pi * (i + 0.5) / WIDTH - math.pi, math.pi / 2 - math.pi * (j + 0.5) / HEIGHT)

    return [[round(255 * albedo(direction(i, j))) for i in range(WIDTH)] for j in range(HEIGHT)]


folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
(folder / "rock.obj").write_text(obj())
(folder / "rock.png").write_bytes(png(texture()))
print(f"{folder / 'rock.obj'}: {2 * COLUMNS * (ROWS - 1)} facets; {folder / 'rock.png'}: {WIDTH} x {HEIGHT} texels")
