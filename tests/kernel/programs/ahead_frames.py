#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Judges frames of edges with jitter: ahead_frames.py FRAMES-FOLDER TIMING COUNT PERIOD-S

Stars and the limb of the body must lie in the picture where the truth table has them: centroids within 0.01 px, the limb within
0.05 px. Every frame from the fourth on must have been made ahead and, of those, none may be late for any reason but the
machine's: rows are counted by what made them late. Prints what it found.
"""
import array
import collections
import csv
import math
import pathlib
import statistics
import sys

STAR_PX, LIMB_PX = 0.01, 0.05
PREDICTED_FROM = 4  # three edges make a prediction
HALF = 5  # of the square about a star
folder, timing, count, period_s = pathlib.Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4])


class Picture:
    def __init__(self, path, row):
        self.width, self.height = int(row["width"]), int(row["height"])
        self.dn = array.array("H", path.read_bytes())
        self.dark = sorted(self.dn)[len(self.dn) // 4]

    def at(self, x, y):
        return self.dn[y * self.width + x] - self.dark

    def between(self, x, y):
        i, j = math.floor(x), math.floor(y)
        u, v = x - i, y - j
        return ((1 - u) * self.at(i, j) + u * self.at(i + 1, j)) * (1 - v) + ((1 - u) * self.at(i, j + 1) + u * self.at(i + 1, j + 1)) * v

    def inside(self, x, y, margin):
        return margin <= x <= self.width - 1 - margin and margin <= y <= self.height - 1 - margin


def centroid(picture, x, y):
    i, j = round(x), round(y)
    light = sx = sy = 0.0
    for v in range(j - HALF, j + HALF + 1):
        for u in range(i - HALF, i + HALF + 1):
            dn = picture.at(u, v)
            light, sx, sy = light + dn, sx + u * dn, sy + v * dn
    return sx / light, sy / light


def solved(rows):
    """Least squares of a + b nx + c ny over (nx, ny, value)."""
    m = [[0.0] * 4 for _ in range(3)]
    for nx, ny, value in rows:
        base = (1, nx, ny)
        for i in range(3):
            for k in range(3):
                m[i][k] += base[i] * base[k]
            m[i][3] += base[i] * value
    for i in range(3):
        m[i] = [v / m[i][i] for v in m[i]]
        for k in range(3):
            if k != i:
                m[k] = [a - m[k][i] * b for a, b in zip(m[k], m[i])]
    return [m[i][3] for i in range(3)]


def limb(picture, points, centre):
    """How far out the limb is in the picture against the truth, and how far it is shifted: the light about it over that inside."""
    profiles = []
    for x, y in points:
        nx, ny = x - centre[0], y - centre[1]
        r = math.hypot(nx, ny)
        nx, ny = nx / r, ny / r
        profiles.append((nx, ny, [picture.between(x + s / 4 * nx, y + s / 4 * ny) for s in range(-16, 17)]))
    # Lit from behind the camera, the disc is of one brightness.
    within = sum(sum(profile[:9]) / 9 for _, _, profile in profiles) / len(profiles)
    out, dx, dy = solved([(nx, ny, sum(profile) / 4 / within - 4.125) for nx, ny, profile in profiles])
    return out, math.hypot(dx, dy)


truth = collections.defaultdict(list)
with open(folder / "truth.csv", encoding="ascii", newline="") as table:
    for entry in csv.DictReader(table):
        truth[int(entry["frame"])].append(entry)
with open(timing, encoding="ascii", newline="") as table:
    made = {int(row["frame_id"]): row for row in csv.DictReader(table)}
stars, shifts, outs, edges = [], [], [], []
for number in range(1, count + 1):
    picture = Picture(folder / f"frame_{number:06}.raw", made[number])
    edges.append(int(made[number]["edge_ns"]))
    here = truth[number]
    body = next((float(e["x_px"]), float(e["y_px"])) for e in here if e["kind"] == "body" and e["name"] == "moonlet")
    for e in here:
        if e["kind"] == "star" and e["visibility"] == "visible" and e["saturated"] == "0":
            x, y = float(e["x_px"]), float(e["y_px"])
            if picture.inside(x, y, HALF + 1) and math.hypot(x - body[0], y - body[1]) > 25:
                found = centroid(picture, x, y)
                stars.append((math.hypot(found[0] - x, found[1] - y), number))
    points = [(float(e["x_px"]), float(e["y_px"])) for e in here if e["kind"] == "limb" and e["object"] == "0" and e["lit"] == "1"]
    if len(points) >= 8 and all(picture.inside(x, y, 6) for x, y in points):
        out, shift = limb(picture, points, body)
        shifts.append((shift, number))
        outs.append((abs(out), number))
# The jitter that came, but for edges that are late because the emulated machine stood still.
phases = sorted(t / 1e6 - k * 1e3 * period_s for k, t in enumerate(edges))
off_ms = sorted(abs(phase - phases[count // 2]) for phase in phases)
jitter_ms = math.sqrt(statistics.fmean(off * off for off in off_ms if off < 5))
late = {"prediction": 0, "load": 0, "first": 0}
moved = anew = degraded = 0
for number in range(1, count + 1):
    row = made[number]
    rows, ahead = int(row["late_rows"]), int(row["ahead_ns"]) > 0
    reprojected = float(row["ahead_error_upx"]) > 20_000
    moved += reprojected
    degraded += int(row["rows_degraded"]) > 0
    if number >= PREDICTED_FROM and not ahead:
        anew += 1
    late["first" if number < PREDICTED_FROM else "load" if ahead else "prediction"] += rows
moving = sorted(float(made[k]["ahead_error_upx"]) / 1e6 for k in range(PREDICTED_FROM, count + 1))
print(f"{count} edges with a jitter of {jitter_ms:.2f} ms rms, the worst {off_ms[-1]:.1f} ms off: images moved by {moving[len(moving) // 2]:.3f} px (median), {moving[-1]:.3f} px (worst); "
      f"{moved} frames reprojected, {anew} not made ahead, {degraded} degraded")
print(f"rows late: {late['prediction']} of frames that were not made ahead, {late['load']} of others, by the machine's load, "
      f"{late['first']} of the first {PREDICTED_FROM - 1} frames")
print(f"{len(stars)} stars at most {max(stars)[0]:.4f} px from their truth, {len(shifts)} limbs shifted by at most {max(shifts)[0]:.3f} px, "
      f"{max(outs)[0]:.3f} px out")
faults = [f"a star of frame {k} is {off:.4f} px off" for off, k in stars if off > STAR_PX]
faults += [f"the limb of frame {k} is {off:.3f} px off" for off, k in shifts + outs if off > LIMB_PX]
if len(stars) < 2 * count or len(shifts) < count // 2:
    faults.append("too few stars or limbs are in the pictures")
if late["prediction"]:
    faults.append("rows are late that were not made ahead")
if not 0.7 < jitter_ms < 2:
    faults.append("the edges do not have the jitter that they must have")
sys.exit("\n".join(faults) or 0)
