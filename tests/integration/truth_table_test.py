#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Truth tables of `obscura capture` and `obscura render`: positions and electrons against the expected electrons of every
pixel, row times and poses against the frame's own record, CSV against FITS.

Usage: truth_table_test.py OBSCURA
Exit status 1 if a check failed.
"""
import csv
import math
import pathlib
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures  # noqa: E402

obscura = sys.argv[1]


def run(arguments, folder, status=0):
    done = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, timeout=120)
    check(" ".join(str(a) for a in arguments[:2]) + f" ends with {status}", done.returncode == status, done.stderr)
    return done


def read_fits(path):
    """Header and data unit of each HDU, by the FITS standard 4.0."""
    data, at, units = path.read_bytes(), 0, []
    while at < len(data):
        header = {}
        while True:
            cards = [data[at + i:at + i + 80].decode("ascii") for i in range(0, 2880, 80)]
            at += 2880
            for card in cards:
                if card[8:10] == "= ":
                    text = card[10:]
                    text = text[1:text.index("'", 1)].rstrip() if text.startswith("'") else text.split("/")[0].strip()
                    header[card[:8].rstrip()] = text
            if any(c.startswith("END ") for c in cards):
                break
        length = abs(int(header["BITPIX"])) // 8 if int(header["NAXIS"]) else 0
        for i in range(int(header["NAXIS"])):
            length *= int(header[f"NAXIS{i + 1}"])
        units.append((header, data[at:at + length]))
        at += (length + 2879) // 2880 * 2880
    return units


def table(unit):
    """Rows of a binary table as dictionaries."""
    header, data = unit
    kinds = {"J": "i", "K": "q", "D": "d"}
    names, form, counts = [], ">", []
    for i in range(1, int(header["TFIELDS"]) + 1):
        names.append(header[f"TTYPE{i}"])
        of = header[f"TFORM{i}"]
        form += of[:-1] + "s" if of.endswith("A") else kinds[of[-1]]
    width = int(header["NAXIS1"])
    assert struct.calcsize(form) == width
    rows = []
    for at in range(0, width * int(header["NAXIS2"]), width):
        values = struct.unpack_from(form, data, at)
        rows.append({n: v.rstrip(b"\0 ").decode() if isinstance(v, bytes) else v for n, v in zip(names, values)})
    return rows


def product(a, b):
    """Of two quaternions, scalar first."""
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


def pixels(unit):
    header, data = unit
    width, height = int(header["NAXIS1"]), int(header["NAXIS2"])
    values = struct.unpack(f">{width * height}f", data)
    return [values[y * width:(y + 1) * width] for y in range(height)]


with tempfile.TemporaryDirectory(prefix="obscura-truth-") as name:
    folder = pathlib.Path(name)
    (folder / "stars.csv").write_text("ra_deg,dec_deg,v_mag\n0.3,0.25,1\n359.65,-0.05,2\n0.05,-0.3,2.5\n0.35,0.05,3\n")
    # Looks along +x with +z up and turns about its own axes at 1 deg/s.
    rows = []
    for i in range(61):
        half, axis = math.radians(i * 0.1) / 2, (0.2, 1, 0.1)
        n = math.sin(half) / math.sqrt(sum(a * a for a in axis))
        rows.append(product((0.5, -0.5, 0.5, -0.5), (math.cos(half), *(n * a for a in axis))))
    (folder / "path.csv").write_text("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n" + "".join(
        f"{i * 0.1:.1f},-20000,30,-20,{','.join(map(str, q))}\n" for i, q in enumerate(rows)))
    (folder / "scene.toml").write_text("""aberration = true
[sun]
direction = [-1, 0, 0.3]
distance_au = 1
[stars]
catalogue = "stars.csv"
[camera]
focal_length_mm = 50
aperture_mm = 25
psf_sigma_px = 0.7
trajectory = "path.csv"
velocity_m_s = [0, 20000, 10000]
[[body]]
name = "rock"
shape = "ellipsoid"
radii_m = [30, 20, 25]
albedo = 0.3
""")
    camera = """[scene]
file = "scene.toml"
[daemon]
run = 5
seed = 3
[trigger]
source = "timer"
rate_hz = 20
[camera]
exposure_us = 20000
[[camera.window]]
width = 160
height = 100
exposure_us = 20000
[[camera.window]]
width = 80
height = 40
offset_x = 40
offset_y = 110
exposure_us = 10000
[sensor.readout]
width = 160
height = 160
shutter = "rolling"
[sensor.detector]
dark_current_e_per_s = 0
"""
    (folder / "camera.toml").write_text(camera)
    run([obscura, "capture", "camera.toml", "-n", "2", "--format", "fits", "--truth", "-o", "frames", "--truth-table",
         "truth.csv"], folder)
    run([obscura, "capture", "camera.toml", "-n", "2", "-o", "again", "--truth-table", "truth.fits"], folder)
    refused = run([obscura, "capture", "camera.toml", "-o", "again", "--truth-table", "truth.txt"], folder, 74)
    check("other endings are refused by name", "truth.txt" in refused.stderr and ".csv" in refused.stderr,
          refused.stderr)

    lines = list(csv.DictReader((folder / "truth.csv").open()))
    check("two frames", {line["frame"] for line in lines} == {"1", "2"})
    for frame in (1, 2):
        own = [line for line in lines if line["frame"] == str(frame)]
        units = read_fits(folder / "frames" / f"truth_{frame:06}.fits")
        header, mean_e = units[0][0], pixels(units[0])
        check("the table joins the picture by its number", header["FRAMEID"] == str(frame))

        # Row times.
        starts = [line for line in own if line["kind"] == "rows"]
        rows, wrong = table(units[3]), 0
        for y, row in enumerate(rows):
            block = [s for s in starts if int(s["item"]) <= y][-1]
            reset = int(block["time_ns"]) - int(block["exposure_ns"]) // 2
            wrong += (reset, reset + int(block["exposure_ns"])) != (row["RESET"], row["READ"])
        check("exact times of every row", len(rows) == 140 and wrong == 0, wrong)

        # Poses.
        poses = {line["name"]: line for line in own if line["kind"] == "pose"}
        check("poses of camera and body", list(poses) == ["camera", "rock"])
        check("the camera's pose is that of the header",
              all(math.isclose(float(poses["camera"][c]), float(header[k]), rel_tol=1e-12, abs_tol=1e-12) for c, k in
                  [("position_x_m", "CAM_X"), ("position_z_m", "CAM_Z"), ("q_w", "CAM_QW"), ("q_y", "CAM_QY")]))
        check("mid-exposure", poses["camera"]["time_ns"] == header["T_MID"])
        sun = [float(poses["rock"][f"sun_{a}"]) for a in "xyz"]
        check("direction of the Sun", math.isclose(sun[0] / sun[2], -1 / 0.3, rel_tol=1e-6), sun)

        # Stars against the expected electrons, which have the response of every pixel in them.
        stars = [line for line in own if line["kind"] == "star" and line["visibility"] == "visible"]
        check("stars in both windows", {line["window"] for line in stars} == {"0", "1"}, stars)
        for star in stars:
            x, y, reach = float(star["x_px"]), float(star["y_px"]), 9
            top, bottom, right = (0, 99, 159) if star["window"] == "0" else (100, 139, 79)
            if not (reach <= x <= right - reach and top + reach <= y <= bottom - reach):
                continue
            cx, cy, total, peak = 0, 0, 0, 0
            for j in range(round(y) - reach, round(y) + reach + 1):
                for i in range(round(x) - reach, round(x) + reach + 1):
                    e = mean_e[j][i]
                    cx, cy, total, peak = cx + e * i, cy + e * j, total + e, max(peak, e)
            cx, cy = cx / total, cy / total
            what = f"star {star['object']} of frame {frame}"
            check(what + " is where the table says", math.hypot(cx - x, cy - y) < 0.01, (cx, cy, x, y))
            check(what + " has the electrons of the table", abs(total / float(star["signal_e"]) - 1) < 0.02,
                  (total, star["signal_e"]))
            check(what + " has the peak of the table", abs(peak / float(star["peak_e"]) - 1) < 0.06,
                  (peak, star["peak_e"]))
            check(what + " has no more than its shot noise", 0 < float(star["snr"]) < math.sqrt(total))
        rock = [line for line in own if line["kind"] == "body" and line["name"] == "rock"]
        check("the body has an entry", rock and rock[0]["visibility"] == "visible" and
              math.isclose(float(rock[0]["range_m"]), math.hypot(20000, 30, 20), rel_tol=1e-9), rock)
        limb = [line for line in own if line["kind"] == "limb"]
        check("the limb has 72 points about the body", len(limb) == 72 and
              math.hypot(sum(float(p["x_px"]) for p in limb) / 72 - float(rock[0]["x_px"]),
                         sum(float(p["y_px"]) for p in limb) / 72 - float(rock[0]["y_px"])) < 0.01)
        check("the Sun is outside", [line["visibility"] for line in own if line["name"] == "sun"] == ["outside"])

    # The FITS file says the same.
    units = read_fits(folder / "truth.fits")
    check("tables of the FITS file", [u[0].get("EXTNAME") for u in units[1:]] == ["TRUTH", "POSES", "ROWS"])
    entries = table(units[1])
    texts = [line for line in lines if line["kind"] not in ("pose", "rows")]
    check("as many entries", len(entries) == len(texts), (len(entries), len(texts)))
    different = []
    for entry, line in zip(entries, texts):
        for key, value in entry.items():
            text = line[key.lower()]
            same = (math.isnan(value) if text == "" else
                    value == float(text) or math.isclose(value, float(text), rel_tol=1e-9, abs_tol=6e-6)) \
                if isinstance(value, float) else str(value) == text
            if not same:
                different.append((key, value, text))
    check("the same values", not different, different[:4])
    check("as many poses", len(table(units[2])) == 4)

    # A render: scene time, no detector.
    run([obscura, "render", "scene.toml", "-o", "scene.fits", "--time", "0.5", "--exposure", "0.01", "--truth-table",
         "render.csv"], folder)
    lines = list(csv.DictReader((folder / "render.csv").open()))
    stars = [line for line in lines if line["kind"] == "star"]
    check("stars of a render", len(stars) == 4 and all(s["signal_e"] == "" and float(s["irradiance_w_m2"]) > 0 and
                                                       s["time_ns"] == "500000000" for s in stars), stars[:1])
    header, data = read_fits(folder / "scene.fits")[0]
    picture = pixels((header, data))
    for star in stars:
        x, y = float(star["x_px"]), float(star["y_px"])
        box = [(i, j, picture[j][i]) for j in range(round(y) - 4, round(y) + 5) for i in range(round(x) - 4, round(x) + 5)]
        total = sum(v for _, _, v in box)
        cx, cy = sum(i * v for i, _, v in box) / total, sum(j * v for _, j, v in box) / total
        check(f"star {star['object']} of the render", math.hypot(cx - x, cy - y) < 2e-3 and
              abs(total / float(star["irradiance_w_m2"]) - 1) < 1e-3, (cx, cy, x, y))

sys.exit(1 if failures else 0)
