#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Four night-sky frames of a star tracker's camera (esa/tetra3, starcam_tetra3 of the data folder) rendered from their
attitude, focal length and k1 alone, with a catalogue that `obscura import stars` makes of kstars' stars: positions and
fluxes against those measured in the real frames, by `obscura compare`, and rendered fluxes against the catalogue's V.
Positions of the real stars are those of the data folder's list; fluxes are sums over 5 x 5 pixels of the frames less the
median around, of stars that are not saturated and stand out of the noise by a factor of 3. Prints a table.
Usage: star_frames_test.py OBSCURA [FOLDER for scenes, frames and lists]"""
import csv
import gzip
import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    print("SKIPPED: no numpy")
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
from read_image import read_fits  # noqa: E402

DATA = pathlib.Path(os.environ.get("OBSCURA_DATA", ROOT.parent / "shared" / "data"))
FRAMES, KSTARS = DATA / "starcam_tetra3", DATA / "stars" / "kstars_stars.dat.gz"
for needed in (FRAMES, KSTARS):
    if not needed.exists():
        print("SKIPPED:", needed, "is not there")
        sys.exit(77)

obscura = str(pathlib.Path(sys.argv[1]).resolve())
folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp())
folder.mkdir(exist_ok=True)
failures = []
PITCH_UM = 6.9  # IMX265, binned 2 x 2
WIDTH, HEIGHT = 1024, 768
# Bessell's V, PASP 102, 1181 (1990), table 2: 470 to 700 nm.
V = [0, .03, .163, .458, .78, .967, 1, .973, .898, .792, .684, .574, .461, .359, .27, .197, .135, .081, .045, .025, .017,
     .013, .009, 0]
# Response of the camera, photons: IMX265, config/sensors/imx-3.45um.toml, times the wavelength.
RESPONSE = [(400, 0.47), (450, 0.6), (500, 0.66), (525, 0.67), (550, 0.66), (600, 0.6), (650, 0.51), (700, 0.4), (750, 0.31),
            (800, 0.22), (850, 0.15), (900, 0.09), (950, 0.05), (1000, 0.02)]


def check(good, what):
    if not good:
        failures.append(what)
        print("FAILED:", what)


def run(*arguments, status=0):
    done = subprocess.run([obscura, *map(str, arguments)], capture_output=True, text=True, cwd=folder)
    check(done.returncode == status, f"{arguments}: exit {done.returncode}: {done.stderr}")
    return done.stdout


def quaternion(m):
    """Scalar first, of a rotation matrix."""
    w = math.sqrt(max(0, 1 + m[0, 0] + m[1, 1] + m[2, 2])) / 2
    x = math.copysign(math.sqrt(max(0, 1 + m[0, 0] - m[1, 1] - m[2, 2])) / 2, m[2, 1] - m[1, 2])
    y = math.copysign(math.sqrt(max(0, 1 - m[0, 0] + m[1, 1] - m[2, 2])) / 2, m[0, 2] - m[2, 0])
    z = math.copysign(math.sqrt(max(0, 1 - m[0, 0] - m[1, 1] + m[2, 2])) / 2, m[1, 0] - m[0, 1])
    return w, x, y, z


def fits_image(path):
    """The bands of an image."""
    numbers, _, header = read_fits(path.read_bytes())
    return np.array(numbers).reshape([int(header[f"NAXIS{i}"]) for i in (3, 2, 1)])


def tiff_image(path):
    """An uncompressed TIFF of 16 bits, little endian."""
    raw = path.read_bytes()
    at, = struct.unpack_from("<I", raw, 4)
    tags = {}
    for i in range(struct.unpack_from("<H", raw, at)[0]):
        tag, kind, count = struct.unpack_from("<HHI", raw, at + 2 + 12 * i)
        if kind in (3, 4) and count == 1:
            tags[tag] = struct.unpack_from("<H" if kind == 3 else "<I", raw, at + 10 + 12 * i)[0]
    return np.frombuffer(raw, "<u2", tags[256] * tags[257], tags[273]).reshape(tags[257], tags[256]).astype(float)


def real_list(frame, path):
    """Writes the stars of a real frame with their fluxes; the cell is empty where there is none."""
    image = tiff_image(FRAMES / f"{frame}.tiff")
    around = np.hypot(*np.mgrid[-10:11, -10:11]) > 6
    with open(path, "w") as out:
        out.write("x_px,y_px,flux_dn,V\n")
        for star in csv.DictReader(open(FRAMES / "share_alt40_truth_stars.csv")):
            if star["image"] != frame:
                continue
            x, y = round(float(star["x_px"])), round(float(star["y_px"]))
            flux = ""
            if 10 < x < WIDTH - 11 and 10 < y < HEIGHT - 11:
                ring = image[y - 10:y + 11, x - 10:x + 11][around]
                square = image[y - 2:y + 3, x - 2:x + 3]
                noise = 1.48 * np.median(np.abs(ring - np.median(ring)))
                total = (square - np.median(ring)).sum()
                if square.max() < 65000 and total > 3 * 5 * noise:
                    flux = f"{total:.1f}"
            out.write(f"{star['x_px']},{star['y_px']},{flux},{star['V']}\n")


def kstars_catalogue():
    """Directions (unit vectors) and V of kstars' text, read here once more: fixed columns."""
    directions, magnitudes = [], []
    for line in gzip.open(KSTARS, "rt", encoding="latin-1"):
        if line.startswith("#") or len(line) < 58:
            continue
        ra = math.radians(15 * (int(line[0:2]) + int(line[2:4]) / 60 + float(line[4:9]) / 3600))
        dec = math.radians(int(line[11:13]) + int(line[13:15]) / 60 + float(line[15:19]) / 3600)
        dec = -dec if line[10] == "-" else dec
        directions.append((math.cos(dec) * math.cos(ra), math.cos(dec) * math.sin(ra), math.sin(dec)))
        magnitudes.append(float(line[46:51]))
    return np.array(directions), np.array(magnitudes)


def stars_of(bands, radius=4):
    """Local maxima of the first band with their centroids and the fluxes of all in squares of 2 radius + 1 pixels."""
    found = []
    bands = np.pad(bands, ((0, 0), (radius, radius), (radius, radius)))
    image = bands[0]
    inner = image[radius:-radius, radius:-radius]
    peak = inner > 0
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            if dx or dy:
                peak &= inner >= image[radius + dy:image.shape[0] - radius + dy,
                                       radius + dx:image.shape[1] - radius + dx]
    for y, x in np.argwhere(peak) + radius:
        square = image[y - radius:y + radius + 1, x - radius:x + radius + 1]
        if square[radius, radius] < square.max():
            continue
        ys, xs = np.mgrid[y - radius:y + radius + 1, x - radius:x + radius + 1]
        found.append(((square * xs).sum() / square.sum() - radius, (square * ys).sum() / square.sum() - radius,
                      *bands[:, y - radius:y + radius + 1, x - radius:x + radius + 1].sum((1, 2))))
    return found


run("import", "stars", KSTARS, "-o", "kstars.obstars")
directions, magnitudes = kstars_catalogue()
attitudes = list(csv.DictReader(open(FRAMES / "share_alt40_truth_attitude.csv")))
check(len(attitudes) == 4, "four frames")
all_real_v = []
points = ", ".join(f"[{470 + 10 * i}, {t}]" for i, t in enumerate(V))
response = ", ".join(f"[{w}, {q * w / 1000:.4f}]" for w, q in RESPONSE)
print("frame          stars matched  rms px       shift px  | fluxes  V rms mag  real rms mag  real less V rms mag")
for frame in attitudes:
    name = frame["image"].split("_", 1)[1].replace("_Try1", "")
    matrix = np.array([[float(frame[f"R{i}{j}"]) for j in range(3)] for i in range(3)])
    focal_px, k1 = float(frame["focal_px_fit"]), float(frame["k1_fit"])
    (folder / f"{name}.toml").write_text(f"""\
name = "{name}"
[stars]
catalogue = "kstars.obstars"
[sun]
irradiance_scale = 0
[camera]
width = {WIDTH}
height = {HEIGHT}
pixel_pitch_um = {PITCH_UM}
focal_length_mm = {focal_px * PITCH_UM / 1000!r}
aperture_mm = {35 / 1.9!r}
psf_sigma_px = 0.8
distortion = "opencv"
distortion_coefficients = [{k1}]
orientation = [{", ".join(f"{q:.12f}" for q in quaternion(matrix.T))}]
[[band]]
from_nm = 470
to_nm = 700
transmission = [{points}]
[[band]]
from_nm = 400
to_nm = 1000
transmission = [{response}]
""")
    run("render", f"{name}.toml", "-o", f"{name}.fits")
    rendered = stars_of(fits_image(folder / f"{name}.fits"))
    with open(folder / f"{name}.csv", "w") as out:
        out.write("x_px,y_px,flux_v,flux\n" + "".join(f"{x:.5f},{y:.5f},{v:.6e},{camera:.6e}\n"
                                                      for x, y, v, camera in rendered))
    real_list(frame["image"], folder / f"{name}_real.csv")
    pair = [f"{name}_real.csv", f"{name}.csv", "--match-radius", 2]
    real = json.loads(run("compare", *pair, "--reference-column", "flux_dn", "--image-column", "flux", "--json",
                          "--max-rms", 0.3, "--max-mag-rms", 0.3, "--pairs", f"{name}_pairs.csv"))
    check(real["reference_stars"] == int(frame["n_stars"]) and real["pairs"] == real["reference_stars"],
          f"{name}: {real['pairs']} of {real['reference_stars']} measured stars are rendered")
    check(real["with_magnitude"] >= 40, f"{name}: {real['with_magnitude']} stars have fluxes")
    # The real frame alone against the catalogue's V.
    fluxes = [(float(r["flux_dn"]), float(r["V"])) for r in csv.DictReader(open(folder / f"{name}_real.csv")) if r["flux_dn"]]
    real_v = np.array([-2.5 * math.log10(f) - v for f, v in fluxes])
    all_real_v.extend(real_v - real_v.mean())

    # Rendered fluxes against the catalogue, of stars with no other one near.
    seen = directions @ matrix.T
    front = seen[:, 2] > 0.9
    ideal = seen[front, :2] / seen[front, 2:]
    place = np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2]) + focal_px * ideal * (1 + k1 * (ideal**2).sum(1, keepdims=True))
    bright = magnitudes[front]
    inside = ((place > 8) & (place < [WIDTH - 9, HEIGHT - 9])).all(1)
    place, bright = place[inside], bright[inside]
    offsets = []
    for x, y, flux, _ in rendered:
        distance = np.hypot(place[:, 0] - x, place[:, 1] - y)
        if (distance < 12).sum() == 1 and distance.min() < 0.5:
            offsets.append(-2.5 * math.log10(flux) - bright[distance.argmin()])
    offsets = np.array(offsets)
    zero = np.median(offsets)
    worst = np.abs(offsets - zero).max()
    check(len(offsets) > 100 and worst < 0.02, f"{name}: fluxes of {len(offsets)} stars follow V within {worst:.4f} mag")
    print(f"{name:<14} {real['reference_stars']:5d} {real['pairs']:7d} {real['rms']:7.3f} "
          f"{real['shift_right']:+7.3f}{real['shift_down']:+7.3f} {real['with_magnitude']:9d} "
          f"{math.sqrt(((offsets - zero)**2).mean()):10.4f} {real['zero_point_rms']:13.3f} {real_v.std():20.3f}")
    # The limits are limits.
    for limit in (["--max-rms", 0.01], ["--max-mag-rms", 0.01], ["--min-pairs", 1000]):
        run("compare", *pair, *limit, status=1)

rms = np.std(all_real_v)
check(rms < 0.3, f"real fluxes follow V to {rms:.3f} mag rms")
print(f"{len(all_real_v)} real fluxes follow V to {rms:.3f} mag rms, each frame with its zero point")
print(f"{len(failures)} failures")
sys.exit(1 if failures else 0)
