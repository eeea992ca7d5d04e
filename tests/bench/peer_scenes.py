# SPDX-License-Identifier: Apache-2.0
"""The scenes that validation.py renders with both programs: files of this one's kind, which cycles_scene.py reads too."""
import os
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
MOON_M = 1737400.0

BODY = """name = "{name}"
max_bounces = {bounces}
quantity = "radiance"

[sun]
direction = {sun}
distance_au = 1

[camera]
width = {size}
height = {size}
pixel_pitch_um = 10
focal_length_mm = {focal_mm}
aperture_mm = 10
psf_sigma_px = 0
position_m = {eye}
look_at_m = {at}
up = {up}

[[band]]
from_nm = 549.5
to_nm = 550.5

[[body]]
name = "{name}"
material = "lambert"
albedo = 0.12
{shape}
"""
MESH = """shape = "mesh"
file = "{file}"
smooth_normals = false"""
PLANET = """shape = "planet"
radii_m = [{radius_m}, {radius_m}, {radius_m}]
cell_px = 1
[[body.height]]
file = "{file}"
"""

# Scenes of ours whose peer renders another one: a mesh of the same heights.
PEERS = {"terrain": "moon", "terrain-limb": "limb"}


class Skipped(Exception):
    """A scene cannot be had; the reason."""


def data_folder():
    return pathlib.Path(os.environ.get("OBSCURA_DATA", ROOT.parent / "shared/data"))


def asteroid(folder, render_bench):
    file = folder / "asteroid.ply"
    if not file.exists():
        subprocess.run([render_bench, "--write-asteroid", file], check=True)
    return file


def ldem_4(suffix):
    file = data_folder() / f"dem_moon_lola_ldem4/LDEM_4{suffix}"
    if not file.exists():
        raise Skipped(f"{file.name} is not in the data folder (OBSCURA_DATA)")
    return file.resolve()


def moon(folder):
    """Writes the Moon as a PLY file: a vertex at the middle of each of LDEM_4's 1440 x 720 pixels and one at each pole,
    2 073 600 facets."""
    file = folder / "moon.ply"
    if file.exists():
        return file
    source = ldem_4(".IMG")
    try:
        import numpy
    except ImportError:
        raise Skipped("Python's numpy is not installed")
    columns, rows = 1440, 720
    radius = MOON_M + 0.5 * numpy.fromfile(source, "<i2").reshape(rows, columns).astype(float)
    latitude = numpy.radians(89.875 - 0.25 * numpy.arange(rows))[:, None]
    longitude = numpy.radians(0.125 + 0.25 * numpy.arange(columns))[None, :]
    points = numpy.stack([radius * numpy.cos(latitude) * numpy.cos(longitude),
                          radius * numpy.cos(latitude) * numpy.sin(longitude),
                          radius * numpy.sin(latitude)], axis=-1).reshape(-1, 3)
    north, south = len(points), len(points) + 1
    points = numpy.concatenate([points, [[0, 0, radius[0].mean()], [0, 0, -radius[-1].mean()]]])
    here = numpy.arange(columns)
    east = (here + 1) % columns
    facets = [numpy.stack([numpy.full(columns, north), here, east], axis=-1)]
    for row in range(rows - 1):
        a, b = row * columns + here, row * columns + east
        facets += [numpy.stack([a, a + columns, b], axis=-1), numpy.stack([b, a + columns, b + columns], axis=-1)]
    last = (rows - 1) * columns
    facets.append(numpy.stack([last + here, numpy.full(columns, south), last + east], axis=-1))
    facets = numpy.concatenate(facets)
    table = numpy.empty(len(facets), dtype=[("n", "u1"), ("v", "<i4", 3)])
    table["n"], table["v"] = 3, facets
    with open(file, "wb") as out:
        out.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\n"
                   f"property float y\nproperty float z\nelement face {len(facets)}\n"
                   "property list uchar int vertex_indices\nend_header\n").encode())
        out.write(points.astype("<f4").tobytes())
        out.write(table.tobytes())
    return file


def write(folder, name, size, render_bench):
    """Writes scene `name` into `folder`; returns its file and that of the peer, or raises Skipped."""
    scene = written(folder, name, size, render_bench)
    return scene, written(folder, PEERS[name], size, render_bench) if name in PEERS else scene


def written(folder, name, size, render_bench):
    """The file of one scene."""
    def focal_mm(field_tan):
        return 0.01 * size / (2 * field_tan)

    def scaled(vector):
        return [MOON_M * v for v in vector]

    if name == "cornell":
        return ROOT / "config/scenes/cornell.toml"
    if name == "asteroid":
        values = dict(sun=[0.7, 0.7, 0.1], eye=[4000.0, 0, 0], at=[0.0, 0, 0], up=[0, 0, 1], focal_mm=focal_mm(0.16))
    elif name in ("limb", "terrain-limb"):
        values = dict(sun=[0.5, 0.8, 0.2], eye=[MOON_M + 100e3, 0, 0], at=scaled([0.968912, 0.247404, 0]), up=[1, 0, 0],
                      focal_mm=focal_mm(0.36397))
    else:
        values = dict(sun=[0.7071, 0.7071, 0.1], eye=scaled([3.4534, 0, 0]), at=[0.0, 0, 0], up=[0, 0, 1],
                      focal_mm=focal_mm(0.325))
    if name in PEERS:
        shape = PLANET.format(file=ldem_4(".LBL"), radius_m=MOON_M)
    else:
        shape = MESH.format(file=asteroid(folder, render_bench) if name == "asteroid" else moon(folder))
    file = folder / f"{name}.toml"
    file.write_text(BODY.format(name=name, size=size, shape=shape, bounces=2 if name == "moon-2-bounces" else 0, **values))
    return file


def with_bands(scene, bands, folder):
    """A copy of a scene file with these of its bands only, from 1."""
    text = scene.read_text()
    head, *blocks = text.split("[[band]]\n")
    last, separator, bodies = blocks[-1].partition("[[body]]")
    blocks[-1] = last

    def choose(match):
        values = match[2].split(",")
        return f"{match[1]}[{','.join(values[b - 1] for b in bands)}]"

    bodies = re.sub(r"(?m)^((?:colour|emission_w_m2_sr) = )\[(.*)\]$", choose, bodies)
    file = folder / f"{scene.stem}-{'-'.join(map(str, bands))}.toml"
    file.write_text(head + "".join("[[band]]\n" + blocks[b - 1] for b in bands) + separator + bodies)
    return file
