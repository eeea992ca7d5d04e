#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura irradiance: facets, force and shadows against numpy, the caustic of a spherical mirror against its formula, files read
by other programs, a series of times, mistakes.
Usage: irradiance_test.py OBSCURA"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures  # noqa: E402

obscura = sys.argv[1]
folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-irradiance-"))
LIGHT_SPEED = 299792458.0
AU = 149597870700.0


def run(*arguments):
    done = subprocess.run([obscura, "irradiance", *map(str, arguments)], capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout, done.stderr


def sums(*arguments):
    status, out, err = run(*arguments, "--json")
    if status != 0:
        raise SystemExit(f"{arguments}: {err}")
    told = json.loads(out)
    return told, {body["name"]: body for body in told["bodies"]}


def scene(name, text):
    (folder / name).write_text(text)
    return name


def mesh(name, vertices, faces, normals=None):
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    if normals is not None:
        lines += [f"vn {x:.9g} {y:.9g} {z:.9g}" for x, y, z in normals]
    lines += ["f " + " ".join(f"{i + 1}//{i + 1}" if normals is not None else f"{i + 1}" for i in face) for face in faces]
    (folder / name).write_text("\n".join(lines) + "\n")


def grid_box(low, high, n):
    """Triangles of a box, each face n x n squares, counter-clockwise from outside."""
    triangles = []
    low, high = np.array(low, float), np.array(high, float)
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            for i in range(n):
                for j in range(n):
                    corners = []
                    for u, v in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                        p = np.empty(3)
                        p[axis] = (low, high)[side][axis]
                        p[a] = low[a] + (high[a] - low[a]) * u / n
                        p[b] = low[b] + (high[b] - low[b]) * v / n
                        corners.append(p)
                    if side == 0:
                        corners.reverse()
                    triangles += [corners[:3], [corners[0], corners[2], corners[3]]]
    return np.array(triangles)


def blocked_by_box(points, direction, low, high):
    """Slab test of rays against a box."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (np.array(low) - points) / direction, (np.array(high) - points) / direction
    near, far = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
    return (far > near) & (far > 1e-9)


def read_ply(file):
    """Header and faces of a binary PLY file, by its own header."""
    data = file.read_bytes()
    head, _, body = data.partition(b"end_header\n")
    elements = []
    for line in head.decode().splitlines():
        words = line.split()
        if words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property":
            elements[-1][2].append(words[1:])
    kinds = {"float": "<f4", "uchar": "u1", "int": "<i4"}
    out, at = {}, 0
    for name, count, properties in elements:
        fields = []
        for p in properties:
            fields += [("n", "u1"), ("corners", "<i4", (3,))] if p[0] == "list" else [(p[1], kinds[p[0]])]
        kind = np.dtype(fields)
        out[name] = np.frombuffer(body, kind, count, at)
        at += kind.itemsize * count
    return out, len(body) - at


# 1. A plate under a box: shadow, irradiance and force on facets, by hand.
low, high = [-0.5, -0.5, 1.0], [0.5, 0.5, 2.0]
plate = grid_box([-3, -3, -0.2], [3, 3, 0], 24)
mesh("plate.obj", plate.reshape(-1, 3), np.arange(len(plate) * 3).reshape(-1, 3))
box = grid_box(low, high, 2)
mesh("box.obj", box.reshape(-1, 3), np.arange(len(box) * 3).reshape(-1, 3))
light = np.array([0.5, 0.2, 1.0])
light /= np.linalg.norm(light)
two = scene("two.toml", f"""[sun]
direction = [{light[0]}, {light[1]}, {light[2]}]
[camera]
position_m = [0, -20, 5]
look_at_m = [0, 0, 0]
[[body]]
name = "plate"
shape = "mesh"
file = "plate.obj"
material = "lambert"
albedo = 0.3
[[body]]
name = "box"
shape = "mesh"
file = "box.obj"
material = "lambert"
albedo = 0
""")
told, bodies = sums(two, "--bounces", 0, "--points", 64, "--whole-spectrum", "-o", "direct.ply")
centres, edges = plate.mean(axis=1), (plate[:, 1] - plate[:, 0], plate[:, 2] - plate[:, 0])
area_normals = np.cross(*edges) / 2
areas = np.linalg.norm(area_normals, axis=1)
normals = area_normals / areas[:, None]
rng = np.random.default_rng(1)
u, v = rng.random((2, len(plate), 400, 1))
flip = u + v > 1
u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
points = plate[:, None, 0] + u * edges[0][:, None] + v * edges[1][:, None]
seen = ~blocked_by_box(points.reshape(-1, 3), light, low, high).reshape(len(plate), -1)
share = np.where(normals @ light > 0, seen.mean(axis=1), 0)
irradiance = 1366.1 * share * np.maximum(normals @ light, 0)
ply, rest = read_ply(folder / "direct-plate.ply")
check("the PLY file holds what its header says", rest == 0 and len(ply["face"]) == len(plate), rest)
check("facets are those of the mesh", np.allclose(ply["face"]["area_m2"], areas, rtol=1e-5) and
      np.allclose(ply["vertex"]["x"][ply["face"]["corners"]], plate[..., 0], atol=1e-5), "")
worst = np.abs(ply["face"]["sun_w_m2"] - irradiance).max()
check("irradiance of each facet is numpy's, shadow and its edge", worst < 0.06 * 1366.1 and
      np.abs(ply["face"]["sun_w_m2"] - irradiance).mean() < 2, f"worst {worst:.1f} W/m2")
clear = (share == 1) & (ply["face"]["lit_share"] > 0.9999)
check("unshaded facets have it exactly", clear.sum() > 300 and np.allclose(ply["face"]["sun_w_m2"][clear], irradiance[clear], rtol=2e-5),
      np.abs(ply["face"]["sun_w_m2"][clear] / irradiance[clear] - 1).max())
power = float((irradiance * areas).sum())
check("its power is", abs(bodies["plate"]["incident_w"]["sun"] / power - 1) < 2e-3, (bodies["plate"]["incident_w"], power))
push = -(irradiance * areas)[:, None] / LIGHT_SPEED * (light + 2 / 3 * 0.3 * normals)
force, torque = push.sum(axis=0), np.cross(centres, push).sum(axis=0)
check("force is numpy's", np.allclose(bodies["plate"]["force_n"], force, rtol=3e-3, atol=1e-7), (bodies["plate"]["force_n"], force))
check("torque is numpy's", np.allclose(bodies["plate"]["torque_nm"], torque, atol=5e-3 * np.abs(torque).max() + 2e-7),
      (bodies["plate"]["torque_nm"], torque))
check("absorbed is what is not reflected", abs(bodies["plate"]["absorbed_w"] / (0.7 * power) - 1) < 2e-3, bodies["plate"])

# 2. The caustic of a spherical mirror of radius 1: E(r) = E0 sum of p dp / (r dr) over the rays that come to r.
rows, columns, aperture = 300, 256, 0.4
p = np.linspace(0, aperture, rows + 1)[1:]
turn = np.linspace(0, 2 * np.pi, columns, endpoint=False)
s = 1 - np.sqrt(1 - p * p)
ring = np.stack([np.outer(p, np.cos(turn)), np.outer(p, np.sin(turn)), np.repeat(s[:, None], columns, 1)], -1).reshape(-1, 3)
vertices = np.vstack([[0, 0, 0], ring])
inward = np.array([0, 0, 1.0]) - vertices
faces = [(0, 1 + k, 1 + (k + 1) % columns) for k in range(columns)]
for r in range(rows - 1):
    for k in range(columns):
        a, b = 1 + r * columns + k, 1 + r * columns + (k + 1) % columns
        faces += [(a, a + columns, b + columns), (a, b + columns, b)]
mesh("dish.obj", vertices, faces, inward)
radii, z = np.linspace(0.004, 0.016, 7), 0.45
screen, members = [], []
for k, (inner, outer) in enumerate(zip(radii[:-1], radii[1:])):
    for j in range(128):
        t = 2 * np.pi * np.array([j, j + 1]) / 128
        a, b, c, d = ([r * np.cos(x), r * np.sin(x), z] for r, x in ((inner, t[0]), (outer, t[0]), (outer, t[1]), (inner, t[1])))
        screen += [[a, c, b], [a, d, c]]  # seen from below
        members += [k, k]
screen = np.array(screen)
mesh("screen.obj", screen.reshape(-1, 3), np.arange(len(screen) * 3).reshape(-1, 3))
dish = scene("dish.toml", f"""[sun]
position_m = [0, 0, {1e3 * AU}]
irradiance_scale = 1e6
[camera]
position_m = [0, -9, 3]
look_at_m = [0, 0, 0]
[[body]]
name = "dish"
shape = "mesh"
file = "dish.obj"
material = "mirror"
reflectance = 1
[[body]]
name = "screen"
shape = "mesh"
file = "screen.obj"
material = "lambert"
albedo = 0.5
""")
told, bodies = sums(dish, "--whole-spectrum", "--photons", 4000000, "-o", "caustic.csv", "--bodies", "screen")
with open(folder / "caustic.csv", encoding="utf-8") as file:
    table = list(csv.DictReader(file))
got = np.zeros(len(radii) - 1)
for row, k in zip(table, members):
    got[k] += float(row["caustic_w_m2"]) * float(row["area_m2"])
fine = np.linspace(0, aperture, 2000001)
mid, dp = (fine[1:] + fine[:-1]) / 2, fine[1] - fine[0]
lands = np.abs(mid - (z - (1 - np.sqrt(1 - mid * mid))) * np.tan(2 * np.arcsin(mid)))
power = 1366.1 * 2 * np.pi * mid * dp
power[(mid > radii[0]) & (mid < radii[-1])] = 0  # the screen's own shadow
want = np.histogram(lands, radii, weights=power)[0]
check("the caustic of a spherical mirror is that of its formula", np.abs(got / want - 1).max() < 0.02, list(got / want))

# 3. Files that other programs read; cells; a series.
ball = scene("ball.toml", """[sun]
direction = [1, 0, 0]
[camera]
position_m = [0, -20, 0]
look_at_m = [0, 0, 0]
[[body]]
name = "ball"
shape = "ellipsoid"
radii_m = [2, 2, 2]
material = "lambert"
albedo = 0.2
spin_axis = [0, 0, 1]
spin_rate_deg_per_s = 0.1
""")
told, bodies = sums(ball, "--rows", 36, "--points", 16, "-o", "ball.fits")
from astropy.io import fits  # noqa: E402
with fits.open(folder / "ball.fits") as read:
    cells = read["PATCHES"].data
    check("astropy reads the FITS table with its units", read["PATCHES"].columns["absorbed_w_m2"].unit == "W m-2" and len(cells) == 36 * 72,
          read["PATCHES"].columns)
    absorbed = (cells["absorbed_w_m2"] * cells["area_m2"]).sum()
    check("its sum is the one printed", abs(absorbed / bodies["ball"]["absorbed_w"] - 1) < 1e-3, (absorbed, bodies["ball"]["absorbed_w"]))
    towards = np.stack([cells["nx"], cells["ny"], cells["nz"]], -1) @ [1.0, 0, 0]
    top = cells["sun_w_m2"].max()
    check("cells see the Sun by their cosine", np.abs(cells["sun_w_m2"] / top - np.maximum(towards, 0)).max() < 0.03, "")
status, _, err = run(ball, "--rows", 36, "-o", "ball.vtk")
text = (folder / "ball.vtk").read_text().split("\n")
check("the VTK file has its counts", status == 0 and text[3] == "DATASET POLYDATA" and "CELL_DATA 2592" in text, err)
status, _, err = run(ball, "--rows", 36, "-o", "ball.exr")
check("cells make an image", status == 0 and (folder / "ball.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01", err)
status, out, err = run(ball, "--until", 600, "--step", 300, "--rows", 36, "--points", 16, "--whole-spectrum")
lines = list(csv.DictReader(out.splitlines()))
expected = 1366.1 * np.pi * 4 / LIGHT_SPEED * (1 + 4 / 9 * 0.2)
check("a series has each time, its force in inertial axes", status == 0 and [float(l["time_s"]) for l in lines] == [0, 300, 600] and
      all(abs(float(l["force_x_n"]) / -expected - 1) < 3e-3 for l in lines), out)

# 4. Mistakes.
for arguments, status, message in ((("two.toml", "-o", "x.pyl"), 64, 'did you mean ".ply"?'),
                                   (("two.toml", "--bodies", "plat"), 78, 'did you mean "plate"?'),
                                   (("two.toml", "-o", "x.exr"), 66, "facets of its mesh"),
                                   (("two.toml", "--until", "-5"), 64, "before --time"),
                                   (("two.toml", "--until", "9", "-o", "x.ply"), 64, "written as .csv"),
                                   (("two.toml", "--time", "noon"), 64, "no epoch")):
    got, out, err = run(*arguments)
    check(f"{' '.join(arguments)} is refused in one line", got == status and message in err and len(err.strip().splitlines()) == 1, (got, err))
check("nothing was left of refused files", not list(folder.glob("x*")), list(folder.iterdir()))
sys.exit(1 if failures else 0)
