#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`obscura truth` of frames of every format and of tables, `obscura sky` against a projection of its own, charts, and
damaged input.

Usage: truth_verbs_test.py OBSCURA
Exit status 1 if a check failed.
"""
import csv
import io
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

obscura = sys.argv[1]
folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-truth-"))
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def run(*words, status=0, has=""):
    done = subprocess.run([obscura, *map(str, words)], cwd=folder, capture_output=True, text=True, timeout=120)
    check(f"obscura {' '.join(map(str, words))} ends with {status}", done.returncode == status and
          has in done.stdout + done.stderr, f"{done.returncode}, wanted \"{has}\": {done.stdout[-300:]}{done.stderr}")
    if status:
        check("the error is one line", done.stderr.count("\n") == 1, done.stderr)
    return done.stdout


# Sirius with a fainter star beside it and one behind the rock.
SIRIUS = (101.28717, -16.71611)
(folder / "stars.csv").write_text(f"ra_deg,dec_deg,v_mag\n102,-16.5,5\n{SIRIUS[0]},{SIRIUS[1]},-1.44\n100.9,-17.2,3\n")


def unit(ra, dec):
    ra, dec = math.radians(ra), math.radians(dec)
    return [math.cos(dec) * math.cos(ra), math.cos(dec) * math.sin(ra), math.sin(dec)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def scaled(a, s):
    return [x * s for x in a]


boresight = unit(101, -17)
rock = scaled(unit(100.9, -17.2), 1000.0)
(folder / "scene.toml").write_text(f"""[sun]
direction = [0, 0, 1]
[stars]
catalogue = "stars.csv"
[camera]
width = 400
height = 300
focal_length_mm = 50
pixel_pitch_um = 18
boresight = {boresight}
up = [0, 0, 1]
[[body]]
name = "rock & co"
shape = "ellipsoid"
radii_m = [3, 3, 3]
albedo = 0.3
position_m = {rock}
[[landmark]]
name = "near side"
body = "rock & co"
position_m = {scaled(rock, -3 / 1000)}
[[landmark]]
name = "far side"
body = "rock & co"
position_m = {scaled(rock, 3 / 1000)}
""")
(folder / "camera.toml").write_text("""[scene]
file = "scene.toml"
[camera]
exposure_us = 20000
""")


def project(direction):
    """Pixel of a direction, by the definition of the camera's axes: x right, y down, z boresight."""
    right = cross(boresight, [0, 0, 1])
    right = scaled(right, 1 / math.sqrt(dot(right, right)))
    down = cross(boresight, right)
    f, z = 50 / 0.018, dot(direction, boresight)
    return 199.5 + f * dot(direction, right) / z, 149.5 + f * dot(direction, down) / z


# obscura sky: the table.
sky = json.loads(run("sky", "scene.toml", "--json"))
stars = sky["stars"]
check("stars, the brightest first", [s["object"] for s in stars] == [1, 2, 0], stars)
check("Sirius has its names", (stars[0]["name"], stars[0]["designation"]) == ("Sirius", "alp CMa"), stars[0])
for star in stars:
    x, y = project(unit(star["ra_deg"], star["dec_deg"]))
    check(f"star {star['object']} is where a projection by hand puts it",
          math.hypot(star["x_px"] - x, star["y_px"] - y) < 1e-4, (star, x, y))
check("the rock hides the star behind it", [s["visibility"] for s in stars] == ["visible", "hidden", "visible"])
body = sky["bodies"][0]
x, y = project(rock)
check("the rock", body["name"] == "rock & co" and math.isclose(body["range_m"], 1000, rel_tol=1e-9) and
      math.hypot(body["x_px"] - x, body["y_px"] - y) < 1e-4, (body, x, y))
marks = {m["name"]: m for m in sky["landmarks"]}
check("landmarks of both sides", (marks["near side"]["visibility"], marks["far side"]["visibility"]) ==
      ("visible", "hidden") and math.hypot(marks["near side"]["x_px"] - x, marks["near side"]["y_px"] - y) < 1e-4, marks)
text = run("sky", "scene.toml", "--faintest", "4")
check("the table for people", "Sirius" in text and "rock & co" in text and "102.0000" not in text, text)

# Instants of a scene with an epoch: 63 s of TAI from before the leap second.
(folder / "dated.toml").write_text('epoch = "2016-12-31T23:59:00Z"\n' + (folder / "scene.toml").read_text())
dated = json.loads(run("sky", "dated.toml", "--json", "--time", "2017-01-01T00:00:02Z"))
check("an instant is scene time from the epoch on", (dated["time_s"], dated["instant"]) == (63, "2017-01-01T00:00:02.000Z"),
      dated)
check("a scene without an epoch has no instants", sky["instant"] is None)
run("sky", "scene.toml", "--time", "2017-01-01T00:00:02Z", status=64, has="the scene has no epoch")
run("sky", "dated.toml", "--time", "2017-13-01", status=78, has="2017-13-01")

# obscura sky: what is no star of a catalogue, in the table, the list and the chart.
(folder / "objects.toml").write_text("""[camera]
focal_length_mm = 50
boresight = [1, 0, 0]
up = [0, 0, 1]
[[sky_object]]
name = "nebula"
kind = "galaxy"
ra_deg = 0.5
dec_deg = 0
v_mag = 6
half_light_radius_arcsec = 60
[[sky_object]]
name = "pulse"
kind = "star"
ra_deg = 0
dec_deg = 1
v_mag = 4
amplitude_mag = 0.5
[[sky_object]]
name = "craft"
kind = "point"
position_m = [1e6, 0, -10000]
v_mag = -25
""")
objects = {o["name"]: o for o in json.loads(run("sky", "objects.toml", "--json"))["sky_objects"]}
check("sky objects have their kinds", {n: o["kind"] for n, o in objects.items()} == {"nebula": "galaxy", "pulse": "star", "craft": "point"}, objects)
scale = 50e-3 / 18e-6  # of the default pitch, px
check("the galaxy is half a degree to the left", abs(objects["nebula"]["x_px"] - (511.5 - scale * math.tan(math.radians(0.5)))) < 1e-6, objects["nebula"])
check("the star is a degree up", abs(objects["pulse"]["y_px"] - (511.5 - scale * math.tan(math.radians(1)))) < 1e-6, objects["pulse"])
check("the point is 10 km down at 1000 km", abs(objects["craft"]["y_px"] - (511.5 + scale * 0.01)) < 1e-6 and
      abs(objects["craft"]["range_m"] - math.hypot(1e6, 1e4)) < 1e-3, objects["craft"])
text = run("sky", "objects.toml", "--faintest", "5")
check("faint ones are left out", "pulse" in text and "nebula" not in text, text)
run("sky", "objects.toml", "-o", "objects.svg")
check("the chart names them", all(name in (folder / "objects.svg").read_text() for name in objects))

# obscura sky: the charts.
run("sky", "scene.toml", "-o", "sky.svg", "--side", "800")
chart = xml.parse(folder / "sky.svg").getroot()
spaces = "{http://www.w3.org/2000/svg}"
labels = [t.text for t in chart.iter(spaces + "text")]
check("the SVG names star and body", "Sirius" in labels and "rock & co" in labels and "near side" in labels and
      "far side" not in labels, labels)
check("the SVG has a coordinate grid", any(t.endswith("°") for t in labels), labels)
discs = [(float(c.get("cx")), float(c.get("cy")), float(c.get("r"))) for c in chart.iter(spaces + "circle")]
edge = [p for p in chart.iter(spaces + "path")][0].get("d").replace("M", "").replace("L", "").replace("Z", "").split()
left, top = float(edge[0]), float(edge[1])
wanted = (left + (stars[0]["x_px"] + 0.5) * 2, top + (stars[0]["y_px"] + 0.5) * 2)
near = [d for d in discs if math.hypot(d[0] - wanted[0], d[1] - wanted[1]) < 0.1]
check("Sirius is drawn at its pixel", len(near) == 1 and near[0][2] > 3, (wanted, discs))
run("sky", "scene.toml", "-o", "sky.png", "--side", "800")
png = (folder / "sky.png").read_bytes()
check("the PNG has the size of the SVG", png[:8] == b"\x89PNG\r\n\x1a\n" and
      list(struct.unpack(">II", png[16:24])) == [int(chart.get("width")), int(chart.get("height"))])
run("sky", "demo", "-o", "demo.svg", has="asteroid")
run("sky", "scene.toml", "-o", "sky.jpg", status=64, has="sky.jpg: the name must end in .svg or .png")
run("sky", "absent.toml", status=66, has="absent.toml")

# obscura truth: frames of every format, joined to their lines of the table.
for ending in ("fits", "png", "raw"):
    run("capture", "camera.toml", "-n", "2", "--format", ending, "-o", ending, "--truth-table",
        f"{ending}/truth.{'fits' if ending == 'png' else 'csv'}")
lines = [line for line in csv.DictReader((folder / "fits/truth.csv").open())
         if line["frame"] == "2" and line["kind"] not in ("pose", "rows")]
for ending in ("fits", "png", "raw"):
    frame = sorted(p for p in (folder / ending).glob(f"*.{ending}") if "truth" not in p.name)[1]
    found = json.loads(run("truth", frame, "--json"))
    header = found["header"]
    check(f"{ending}: header of the frame", header.get("FRAMEID") == 2 and "T_MID" in header and "CAM_QW" in header, header)
    check(f"{ending}: as many entries as lines of the frame", len(found["entries"]) == len(lines),
          (len(found["entries"]), len(lines)))
    different = [(entry, line) for entry, line in zip(found["entries"], lines) for key in ("kind", "x_px", "y_px", "snr")
                 if not (entry[key] is None and line[key] == "") and
                 not (isinstance(entry[key], str) and entry[key] == line[key]) and
                 not (not isinstance(entry[key], str) and
                      math.isclose(entry[key], float(line[key] or "nan"), rel_tol=1e-8, abs_tol=6e-6))]
    check(f"{ending}: the entries are those of the table", not different, different[:1])
text = run("truth", "fits/frame_000002.fits", "--kind", "star")
check("for people: header and stars only", "CAM_QW" in text and "star " in text and "limb" not in text, text)
printed = list(csv.DictReader(io.StringIO(run("truth", "fits/frame_000002.fits", "--csv", "--kind", "limb"))))
check("as CSV: the limb", [p["x_px"] for p in printed] == [line["x_px"] for line in lines if line["kind"] == "limb"])
both = json.loads(run("truth", "png/truth.fits", "--json"))
check("a table by itself has all frames", {e["frame"] for e in both["entries"]} == {1, 2})
run("render", "scene.toml", "-o", "lone/render.fits", "--truth-table", "lone.csv", status=73)
run("render", "scene.toml", "-o", "render.exr", "--truth-table", "render.csv")
found = json.loads(run("truth", "render.exr", "--table", "render.csv", "--frame", "1", "--json"))
check("OpenEXR: header and entries", "CAM_QW" in found["header"] and len(found["entries"]) > 3, found["header"])

# Damaged input.
run("truth", "fits/frame_000002.fits", "--table", "absent.csv", status=66, has="absent.csv")
for kept in (9000, 14000):  # within the table's header, within its rows
    (folder / "cut.fits").write_bytes((folder / "png/truth.fits").read_bytes()[:kept])
    run("truth", "cut.fits", status=66, has="cut.fits: TRUTH:")
(folder / "short.csv").write_text("frame,kind,name\n1,star\n")
run("truth", "short.csv", status=66, has="short.csv:2: 2 cells: allowed are 3")
(folder / "other.csv").write_text("a,b\n1,2\n")
run("truth", "other.csv", status=66, has="other.csv:1: no columns frame and kind")
(folder / "text.fits").write_text("no picture")
run("truth", "text.fits", status=66, has="text.fits: no header")

sys.exit(1 if failures else 0)
