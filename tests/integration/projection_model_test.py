#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura model: the shipped projections against numpy, by their formulas; a new model, mistakes, pictures, a scene.
Usage: projection_model_test.py OBSCURA"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures  # noqa: E402

obscura = sys.argv[1]


def call(*arguments, folder):
    done = subprocess.run([obscura, "model", *arguments], capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout, done.stderr


def radius(x, y):
    return np.sqrt(x * x + y * y)


def angle(d):
    """To the boresight; also of complex numbers, whose imaginary parts are derivatives."""
    across = radius(d[0], d[1])
    return np.pi / 2 - np.arctan(d[2] / np.where(across == 0, 1, across))


def radial(d, f, k1, k2, k3, k4):
    t = angle(d)
    r = f * (t + k1 * t ** 3 + k2 * t ** 5 + k3 * t ** 7 + k4 * t ** 9)
    return np.stack([d[0], d[1]]) * r / radius(d[0], d[1])


def scheimpflug(d, f, k1, k2, tilt):
    """The ray from the origin through (upright, f) meets the plane through (0, 0, f) along x and (0, cos, sin)."""
    x, y = radial(d, f, k1, k2, 0, 0)
    matrix_u, matrix_v = np.array([1.0, 0, 0]), np.array([0, np.cos(tilt), np.sin(tilt)])
    normal = np.cross(matrix_u, matrix_v)
    ray = np.stack([x, y, f + 0 * x])
    hit = ray * (normal[2] * f / np.einsum("i,i...", normal, ray))
    hit = hit - np.array([0, 0, f])[:, None]
    return np.stack([np.einsum("i,i...", matrix_u, hit), np.einsum("i,i...", matrix_v, hit)])


def catadioptric(d, f, shape):
    return f * np.stack([d[0], d[1]]) / (d[2] + shape)


# Name, focal length (mm), settings, formula of the image point of a unit direction, m.
PROJECTIONS = [
    ("radial", 5e-3, {"k1": -0.03, "k2": 0.004, "k3": -0.0006, "k4": 0.0001},
     lambda d, f: radial(d, f, -0.03, 0.004, -0.0006, 0.0001)),
    ("scheimpflug-fisheye", 5e-3, {"k1": -0.04, "k2": 0.002, "tilt_deg": 6},
     lambda d, f: scheimpflug(d, f, -0.04, 0.002, np.radians(6))),
    ("catadioptric", 3.2e-3, {"shape": 0.8, "max_angle_deg": 100}, lambda d, f: catadioptric(d, f, 0.8)),
]

with tempfile.TemporaryDirectory(prefix="obscura-projection-") as temporary:
    folder = pathlib.Path(temporary)
    names = [entry["name"] for entry in json.loads(call("list", "--json", folder=folder)[1]) if entry["kind"] == "projection"]
    check("each shipped projection is tested", sorted(names) == sorted(row[0] for row in PROJECTIONS), names)
    for name, focal, parameters, formula in PROJECTIONS:
        settings = [word for key, value in parameters.items() for word in ("--set", f"{key}={value}")]
        status, said, error = call("check", name, folder=folder)
        check(f"{name} is sound", status == 0 and ": sound: " in said, said + error)
        status, _, error = call("plot", name, *settings, "-o", "table.csv", folder=folder)
        rows = list(csv.DictReader((folder / "table.csv").open())) if status == 0 else []
        column = {key: np.array([float(row[key]) for row in rows]) for key in rows[0]} if rows else {}
        check(f"{name} has a table", status == 0 and len(rows) > 500, f"{len(rows)} {error}")
        if not rows:
            continue
        d = np.stack([column[f"direction_{axis}"] for axis in "xyz"])
        check(f"directions of {name} are unit vectors", np.max(np.abs(np.sum(d * d, axis=0) - 1)) < 1e-15 * 4)
        off = radius(d[0], d[1]) > 1e-9
        with np.errstate(invalid="ignore", divide="ignore"):
            point = formula(d.astype(complex), focal).real / 10e-6 + 511.5
        given = np.stack([column["x_px"], column["y_px"]])
        difference = np.max(np.abs(point - given)[:, off]) / 1024
        check(f"{name} is what numpy makes of its formula", difference < 1e-12, difference)
        # Jacobian by complex steps along two tangents.
        a = np.stack([-d[1], d[0], 0 * d[0]]) / np.maximum(radius(d[0], d[1]), 1e-300)
        b = np.cross(d, a, axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            pa, pb = (formula(d + 1e-30j * t, focal).imag / 1e-30 for t in (a, b))
        expected = 1e-10 / np.maximum(np.abs(pa[0] * pb[1] - pa[1] * pb[0]), 1e-300)
        difference = np.max(np.abs(column["solid_angle_sr"] / expected - 1)[off])
        check(f"solid angles of {name} are its Jacobian's", difference < 1e-11, difference)

    status, said, error = call("new", "projection", "lens", folder=folder)
    check("a new projection is written", (status, said) == (0, "lens.prj\n"), error)
    status, said, error = call("check", "lens.prj", folder=folder)
    check("it is sound", status == 0 and said.startswith("lens.prj: sound: "), said + error)
    shown = json.loads(call("show", "lens.prj", "--json", folder=folder)[1])
    check("what it costs is shown", 2 <= shown["newton_steps"] <= 6 and shown["operations"] > 100, shown)
    for form, begins in (("png", b"\x89PNG"), ("svg", b"<svg"), ("csv", b"x_px,")):
        status, _, error = call("plot", "lens.prj", "-o", f"lens.{form}", folder=folder)
        check(f"it is drawn as {form}", status == 0 and (folder / f"lens.{form}").read_bytes().startswith(begins), error)
    xml.etree.ElementTree.parse(folder / "lens.svg")
    told = json.loads(call("eval", "lens.prj", "--at", "right=300", "--json", folder=folder)[1])
    # The root of t - 0.05 t^3 = 300 px of 10 um over 8 mm.
    t = min(np.roots([-0.05, 0, 1, -300 * 10e-6 / 8e-3]), key=lambda z: abs(z - 0.375)).real
    check("a direction is evaluated", np.allclose(told["direction"], [np.sin(t), 0, np.cos(t)], rtol=0, atol=1e-14), told)
    check("and its transmission", abs(told["transmission"] - np.cos(t)) < 1e-14, told)
    check("a point off the sensor may see nothing", json.loads(
        call("eval", "lens.prj", "--at", "right=60000", "--json", folder=folder)[1])["direction"] is None)

    (folder / "folded.prj").write_text((folder / "lens.prj").read_text().replace("k1 -0.05", "k1 -1"))
    status, said, _ = call("check", "folded.prj", folder=folder)
    check("a folded projection is refused with its pixel", status == 78 and "is not one to one: directions at " in said
          and "at pixel (" in said and said.startswith("folded.prj:"), said)
    status, said, _ = call("check", "catadioptric", folder=folder)
    check("a field beyond 180 degrees is warned of", status == 0 and "warning: the field reaches 1" in said, said)
    bench = json.loads(call("bench", "lens.prj", "--json", folder=folder)[1])
    check("times are measured", 0 < bench["model_ns"] < 1e5 and bench["built_in_ns"]["radial"] > 0, bench)

    (folder / "scene.toml").write_text("""[camera]
width = 48
height = 48
pixel_pitch_um = 10
focal_length_mm = 0.3
aperture_mm = 0.1
position_m = [1000, 0, 0]
look_at_m = [0, 0, 0]
up = [0, 0, 1]
projection = { model = "lens.prj", k1 = -0.1 }
[sun]
direction = [1, 0.2, 0.3]
[[body]]
shape = "ellipsoid"
radii_m = [400, 400, 400]
albedo = 0.2
""")
    done = subprocess.run([obscura, "render", "scene.toml", "-o", "scene.fits"], capture_output=True, text=True, cwd=folder)
    check("a scene renders with it", done.returncode == 0, done.stderr)
    cards = (folder / "scene.fits").read_bytes()[:8640].decode("latin-1") if done.returncode == 0 else ""
    check("the picture's header names it", "PROJ    = 'model" in cards and "PRJMODEL= 'lens.prj'" in cards, cards[:3000])
    done = subprocess.run([obscura, "check", "scene.toml"], capture_output=True, text=True, cwd=folder)
    check("the scene is sound", done.returncode == 0, done.stdout + done.stderr)

sys.exit(1 if failures else 0)
