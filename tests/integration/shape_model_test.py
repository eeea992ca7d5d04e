#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura model: the shipped shapes against numpy, by their formulas; a new model, mistakes, pictures, a scene.
Usage: shape_model_test.py OBSCURA"""
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


def call(*arguments, folder, verb="model"):
    done = subprocess.run([obscura, verb, *arguments], capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout, done.stderr


def superellipsoid(p, a, b, c, e1, e2):
    """Barr's inside-outside function, which is 1 on the surface."""
    x, y, z = np.abs(p[0] / a), np.abs(p[1] / b), np.abs(p[2] / c)
    return (x ** (2 / e2) + y ** (2 / e2)) ** (e2 / e1) + z ** (2 / e1) - 1


def torus(p, ring_radius, tube_radius):
    """Implicit quartic of a torus about z."""
    r2 = p[0] ** 2 + p[1] ** 2 + p[2] ** 2
    return ((r2 + ring_radius ** 2 - tube_radius ** 2) ** 2 - 4 * ring_radius ** 2 * (p[0] ** 2 + p[1] ** 2)) / ring_radius ** 4


def contact_binary(p, radius_1, radius_2, distance, flattening, neck):
    """Smooth minimum h of two lobes: (f - h)(g - h) = neck^2 / 4 with h no larger than either, so at h = 0 f g = neck^2 / 4."""
    def lobe(x, radius):
        return np.sqrt(x ** 2 + p[1] ** 2 + (p[2] / (1 - flattening)) ** 2) - radius
    f, g = lobe(p[0], radius_1), lobe(p[0] - distance, radius_2)
    # Both positive on the surface; else the product's other branch.
    return np.where((f > 0) & (g > 0), f * g / (neck ** 2 / 4) - 1, np.minimum(f, g) / neck)


# Name, parameters, formula that is 0 on the surface, share of the directions that meet it.
SHAPES = [
    ("superellipsoid", {"a": 120, "b": 90, "c": 70, "e1": 0.4, "e2": 0.7}, superellipsoid, 1),
    ("torus", {"ring_radius": 80, "tube_radius": 25}, torus, None),
    ("contact-binary", {"radius_1": 900, "radius_2": 650, "distance": 1300, "flattening": 0.2, "neck": 180}, contact_binary, 1),
]

with tempfile.TemporaryDirectory(prefix="obscura-shape-") as temporary:
    folder = pathlib.Path(temporary)
    names = [entry["name"] for entry in json.loads(call("list", "--json", folder=folder)[1]) if entry["kind"] == "shape"]
    check("each shipped shape is tested", sorted(names) == sorted(row[0] for row in SHAPES), names)
    for name, parameters, formula, share in SHAPES:
        settings = [word for key, value in parameters.items() for word in ("--set", f"{key}={value}")]
        status, said, error = call("check", name, folder=folder)
        check(f"{name} is sound", status == 0 and ": sound: " in said and "warning" not in said, said + error)
        status, _, error = call("plot", name, *settings, "-o", "table.csv", folder=folder)
        rows = list(csv.DictReader((folder / "table.csv").open())) if status == 0 else []
        met = [row for row in rows if row["radius_m"]]
        check(f"{name} has a table", len(rows) == 37 * 72 and len(met) > 100, f"{len(rows)} {len(met)} {error}")
        if share is not None:
            check(f"{name} is met from everywhere", len(met) == len(rows), f"{len(met)} of {len(rows)}")
        longitude, latitude, radius = (np.array([float(row[key]) for row in met])
                                       for key in ("longitude_deg", "latitude_deg", "radius_m"))
        longitude, latitude = np.radians(longitude), np.radians(latitude)
        u = np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)])
        # The value there, over how fast it changes along the radius.
        step = 1e-5 * radius
        slope = (formula(u * (radius + step), **parameters) - formula(u * (radius - step), **parameters)) / (2 * step)
        off = np.abs(formula(u * radius, **parameters) / np.where(np.abs(slope) > 1e-9, slope, np.inf))
        check(f"{name} is where its formula is 0", np.max(off) < 1e-9 * np.max(radius), f"{np.max(off)} m")
        # Nothing lies farther out along the same direction.
        beyond = min(np.min(formula(u * (radius + k * (1.2 * np.max(radius) - radius) / 400), **parameters)) for k in range(1, 400))
        check(f"{name} has nothing outside of its surface", beyond > -1e-9, beyond)
        status, said, error = call("eval", name, *settings, "--at", "x=31.5", "--at", "y=-44.25", "--at", "z=52.125", "--json", folder=folder)
        told = json.loads(said) if status == 0 else {}
        place, h = np.array([31.5, -44.25, 52.125]), 1e-3
        differences = []
        for k in range(3):
            values = []
            for sign in (-1, 1):
                at = place.copy()
                at[k] += sign * h
                values.append(json.loads(call("eval", name, *settings, *(w for axis, x in zip("xyz", at) for w in ("--at", f"{axis}={x!r}")),
                                              "--json", folder=folder)[1])["outside_m"])
            differences.append((values[1] - values[0]) / (2 * h))
        check(f"{name} has the slope of its values", np.allclose(told.get("gradient", []), differences, rtol=1e-6, atol=1e-8),
              f"{told} {differences}")

    status, said, error = call("new", "shape", "rock", folder=folder)
    check("a new shape is written", status == 0 and said == "rock.shp\n", said + error)
    status, said, error = call("check", "rock.shp", folder=folder)
    check("and sound", status == 0 and ": sound: " in said and "warning" not in said, said + error)
    status, _, error = call("plot", "rock.shp", "-o", "rock.png", folder=folder)
    check("and drawn", status == 0 and (folder / "rock.png").read_bytes()[:4] == b"\x89PNG", error)
    status, said, error = call("bench", "rock.shp", "--json", folder=folder)
    told = json.loads(said) if status == 0 else {}
    check("and measured", told.get("model_ns", 0) > 0 and told.get("built_in_ns", {}).get("ellipsoid", 0) > 0, said + error)
    status, said, error = call("show", "rock.shp", folder=folder)
    check("and shown", status == 0 and "bounded by cell" in said and "with the surface" in said, said + error)

    (folder / "wrong.shp").write_text("property lipschitz 0.5;\nscalar bound_radius() { return 3; }\n"
                                      "scalar outside(vec3 p) { return length(p) - 2; }\n")
    status, said, error = call("check", "wrong.shp", folder=folder)
    check("a claim that is too small is told", status == 0 and "wrong.shp:3:8: warning: " in said
          and "the slope exceeds the property lipschitz of 0.5" in said, said + error)
    (folder / "none.shp").write_text("scalar bound_radius() { return 3; }\nscalar outside(vec3 p) { return length(p) + 1; }\n")
    status, said, error = call("check", "none.shp", folder=folder)
    check("a shape without a surface is refused", status == 78 and "none.shp:2:8: outside() has no sign change" in said, said + error)

    (folder / "s.toml").write_text("""[sun]
direction = [1, -0.8, 0.4]
[camera]
width = 64
height = 64
pixel_pitch_um = 10
focal_length_mm = 5
aperture_mm = 10
position_m = [900, 0, 100]
look_at_m = [0, 0, 0]
up = [0, 0, 1]
[[body]]
shape = { model = "rock.shp", radius = 120 }
albedo = 0.3
""")
    status, said, error = call("s.toml", folder=folder, verb="check")
    check("a scene with it is good", status == 0 and "s.toml: good" in said, said + error)
    status, said, error = call("s.toml", "-o", "s.png", folder=folder, verb="render")
    check("and rendered", status == 0 and (folder / "s.png").exists(), error)
    text = (folder / "s.toml").read_text().replace("rock.shp\", radius = 120", "wrong.shp\"")
    (folder / "wrong.toml").write_text(text)
    status, said, error = call("wrong.toml", folder=folder, verb="check")
    check("a scene with a doubtful one says so", status == 0 and "lipschitz of 0.5" in said + error, said + error)

sys.exit(1 if failures else 0)
