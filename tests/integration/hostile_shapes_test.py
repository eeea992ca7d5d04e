#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Damaged shape models: PLY, STL, glTF, GLB, plate models and DAMIT's, mutated at random and always the same way. `obscura
check` accepts them or says one line, in time and in bounded memory, and never ends by a signal or as a bug (70).

Usage: hostile_shapes_test.py OBSCURA [COUNT of each format, 12]
Exit status 1 if a check failed; the files that failed are kept in the folder that it names.
"""
import base64
import json
import pathlib
import random
import re
import resource
import shutil
import struct
import subprocess
import sys
import tempfile

obscura = str(pathlib.Path(sys.argv[1]).resolve())
count = int(sys.argv[2]) if len(sys.argv) > 2 else 12
HANG_S, MEMORY = 60, 4 << 30
POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
failures = []


def ply(binary):
    head = f"ply\nformat {'binary_little_endian' if binary else 'ascii'} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    if binary:
        return head.encode() + b"".join(struct.pack("<3f", *p) for p in POINTS) + b"".join(struct.pack("<B3i", 3, *f) for f in FACES)
    return (head + "".join(f"{x} {y} {z}\n" for x, y, z in POINTS) + "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES)).encode()


def stl(binary):
    if binary:
        return bytes(80) + struct.pack("<I", 4) + b"".join(struct.pack("<12fH", 0, 0, 1, *(v for i in f for v in POINTS[i]), 0) for f in FACES)
    text = "".join("facet normal 0 0 1\nouter loop\n" + "".join("vertex %g %g %g\n" % POINTS[i] for i in f) + "endloop\nendfacet\n" for f in FACES)
    return f"solid a\n{text}endsolid a\n".encode()


def gltf(glb):
    data = b"".join(struct.pack("<3f", *p) for p in POINTS) + b"".join(struct.pack("<3H", *f) for f in FACES)
    tree = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
                          {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}],
            "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
            "buffers": [{"byteLength": len(data)}]}
    if not glb:
        tree["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        return json.dumps(tree).encode()
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)) + struct.pack("<I4s", len(text), b"JSON") + text + \
        struct.pack("<I4s", len(data), b"BIN\0") + data


def plates(kind):
    faces = "".join(f"{a + 1} {b + 1} {c + 1}\n" if kind == "txt" else f"{i + 1} {a + 1} {b + 1} {c + 1}\n" for i, (a, b, c) in enumerate(FACES))
    points = "".join(f"{x} {y} {z}\n" if kind == "txt" else f"{i + 1} {x} {y} {z}\n" for i, (x, y, z) in enumerate(POINTS))
    return (f"4 4\n{points}{faces}" if kind == "txt" else f"4\n{points}4\n{faces}").encode()


SEEDS = [("ply", ply(False)), ("ply", ply(True)), ("stl", stl(False)), ("stl", stl(True)), ("gltf", gltf(False)), ("glb", gltf(True)),
         ("tab", plates("tab")), ("txt", plates("txt"))]
NUMBERS = [b"4294967295", b"-1", b"1e308", b"nan", b"99999999999999999999", b"2147483648", b"0", b"1e-320", b"inf", b"65536"]


def mutated(data, dice):
    data = bytearray(data)
    for _ in range(dice.choice((1, 1, 2, 4, 16))):
        at = dice.randrange(len(data) + 1) if data else 0
        kind = dice.randrange(6)
        if kind == 0 and data:
            data[at % len(data)] = dice.randrange(256)
        elif kind == 1:
            del data[at:at + dice.randrange(1, 30)]
        elif kind == 2:
            data[at:at] = data[at:at + dice.randrange(1, 200)]
        elif kind == 3:
            numbers = list(re.finditer(rb"-?\d+(?:\.\d+)?", data))
            if numbers:
                chosen = dice.choice(numbers)
                data[chosen.start():chosen.end()] = dice.choice(NUMBERS)
        elif kind == 4 and len(data) > 8:
            data[at % (len(data) - 4):at % (len(data) - 4) + 4] = dice.choice((b"\xff\xff\xff\xff", b"\0\0\0\x80", b"\0\0\0\0", b"\xff\xff\xff\x7f"))
        else:
            del data[at:]
    return bytes(data)


def limited():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


tried = accepted = 0
with tempfile.TemporaryDirectory(prefix="obscura-shapes-") as name:
    folder = pathlib.Path(name)
    for format_number, (suffix, seed) in enumerate(SEEDS):
        for number in range(-1, count):
            data = seed if number < 0 else mutated(seed, random.Random(1000 * format_number + number))
            shape = folder / f"shape.{suffix}"
            shape.write_bytes(data)
            (folder / "s.toml").write_text(f'[camera]\nwidth = 8\nheight = 8\n[[body]]\nshape = "mesh"\nfile = "shape.{suffix}"\nalbedo = 0.5\nposition_m = [0, 0, 20]\n')
            try:
                done = subprocess.run([obscura, "check", "--scene", "--quick", "s.toml"], cwd=folder, capture_output=True, timeout=HANG_S, preexec_fn=limited)
                lines = [line for line in done.stderr.decode("utf-8", "replace").splitlines() if "warning:" not in line]
                why = "" if done.returncode == 0 else f"status {done.returncode}: {lines}"
                good = done.returncode == 0 or (done.returncode in (66, 78) and len(lines) == 1 and f"shape.{suffix}" in lines[0])
            except subprocess.TimeoutExpired:
                good, why = False, f"takes more than {HANG_S} s"
            tried += 1
            accepted += good and not why
            if number < 0 and why:
                good = False
            if not good:
                kept = pathlib.Path(tempfile.gettempdir()) / f"obscura-hostile-{format_number}-{number}.{suffix}"
                shutil.copy(shape, kept)
                failures.append(kept)
                print(f"FAILED: {kept}: {why}", flush=True)
print(f"{tried} shape models, {accepted} accepted, {len(failures)} failures")
sys.exit(1 if failures else 0)
