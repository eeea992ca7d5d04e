#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Case study: a flyby down to the lunar south pole over three nested height maps.

Usage: lunar_south_pole.py OBSCURA [--size N] [--samples N] [--sheet FRAMES,SIZE,SAMPLES] [--baked METRES] [--output FOLDER]
                            [--json FILE]
       lunar_south_pole.py OBSCURA --cost [--size N] [--samples N] [--cell-px PIXELS] [--threads N] [--output FOLDER]
Flies along 222.5 E from 60 S at 100 km to 89.46 S at 500 m above the ridge between Shackleton and de Gerlache, over LDEM_4 (7.6 km),
a strip of GLD100 (474 m) and Site01 (10 m) of OBSCURA_DATA (default ../shared/data), with procedural detail between their samples.
Renders four altitudes and a contact sheet under a limit of memory, says what each frame costs, and holds the points met without detail
against the maps, which it reads, interpolates and blends on its own. With --baked the four once more from a giant texture of all of it
within 30 degrees of the pole, at samples of that distance (14: 36 GB, 112: a 64th). Exit status 1 where a figure is further off than it
may be, 77 where data or numpy are missing. With --output also the pictures and the table of docs/cases/lunar-south-pole.md.
With --cost alone: what a frame within the path costs once the tiles of the frame before it are there, at the same four altitudes, with
a fixed number of samples and with adaptive sampling to the same noise, each with shadow rays and with sunlight that is kept with the tiles
(sun_visibility), and how far the pictures of the two differ; with --output into that page's second table.
"""
import argparse
import importlib.util
import json
import math
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import zlib

if not importlib.util.find_spec("numpy"):
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)
import numpy as np

import case_files
from case_report import Report

RADIUS_M = 1737400.0
LONGITUDE, START_LATITUDE, END_LATITUDE = 222.5, -60.0, -89.46
START_M, END_M, FIELD_DEG = 100e3, 500.0, 70.0
GLOBAL = "dem_moon_lola_ldem4/LDEM_4.LBL"
STRIP = "dem_moon_southpole/gld100_64ppd_216-232E_42-90S.tif"
SITE = "dem_moon_southpole/lola_site01_10m.tif"
SUN_ELEVATION_DEG = 8.0  # at the end of the path
SHOWN = (0.0, 0.55, 0.86, 1.0)  # places of the four pictures, as shares of the path
DETAIL = """[body.detail]
terrain = "highlands"
crater_age_ga = 4
boulders_per_m2 = 3e-4
"""
TILES_MIB = 512  # tile_memory_mib
FLIGHT_FRAMES = 46000  # of the flight that this follows
LIMIT_MIB = TILES_MIB + 300  # of the address space of a renderer: code, stacks and maps too


def at(longitude_deg, latitude_deg):
    b, l = math.radians(latitude_deg), math.radians(longitude_deg)
    return np.array([math.cos(b) * math.cos(l), math.cos(b) * math.sin(l), math.sin(b)])


class Path:
    """Latitude in equal steps of arc, altitude above the ground falling with the power that reaches 500 m at the end."""

    def __init__(self, ground_m):
        self.ground_m = ground_m

    def latitude(self, share):
        return START_LATITUDE + share * (END_LATITUDE - START_LATITUDE)

    def altitude(self, share):
        return START_M * (END_M / START_M)**(share**1.6)

    def place(self, share):
        return (RADIUS_M + self.ground_m + self.altitude(share)) * at(LONGITUDE, self.latitude(share))

    def camera(self, share, size):
        """Looks ahead along the meridian, 35 degrees below the horizon."""
        place = self.place(share)
        up = place / np.linalg.norm(place)
        ahead = at(LONGITUDE, self.latitude(share) - 90)
        ahead -= (ahead @ up) * up
        ahead /= np.linalg.norm(ahead)
        look = math.cos(math.radians(35)) * ahead - math.sin(math.radians(35)) * up
        return place, look, up, 2 * math.tan(math.radians(FIELD_DEG / 2)) / size


def sun_direction(elevation_deg):
    """At the end of the path, from the right of the path."""
    up = at(LONGITUDE, END_LATITUDE)
    side = at(LONGITUDE + 90, 0)
    side -= (side @ up) * up
    side /= np.linalg.norm(side)
    return math.sin(math.radians(elevation_deg)) * up + math.cos(math.radians(elevation_deg)) * side


LAYERS = ("", "priority = 1\nfeather_m = 4000\n", "priority = 2\nfeather_m = 1500\n")


def scene_text(files, path, share, size, elevation_deg, detail, layers=LAYERS, trajectory=None, body=""):
    place, look, up, pixel = path.camera(share, size)
    heights = "".join(f'[[body.height]]\nfile = "{file}"\n{more}' for file, more in zip(files, layers))
    return f"""name = "lunar south pole"
[sun]
direction = {list(map(float, sun_direction(elevation_deg)))}
distance_au = 1
[camera]
width = {size}
height = {size}
pixel_pitch_um = 10
focal_length_mm = {0.01 / pixel}
{f'trajectory = "{trajectory}"' if trajectory else f"position_m = {list(map(float, place))}"}
boresight = {list(map(float, look))}
up = {list(map(float, up))}
[[body]]
name = "moon"
shape = "planet"
radii_m = [{RADIUS_M}, {RADIUS_M}, {RADIUS_M}]
material = "moon"
tile_memory_mib = {TILES_MIB}
{body}
{heights}
{detail}
"""


def read_tiff(file):
    """One plane of a little-endian TIFF in deflated tiles with horizontal differences, and the tags that place it."""
    data = file.read_bytes()
    at_entry = int.from_bytes(data[4:8], "little")
    sizes, kinds = {1: 1, 2: 1, 3: 2, 4: 4, 12: 8}, {3: "<u2", 4: "<u4", 12: "<f8", 1: "u1", 2: "u1"}
    tags = {}
    for k in range(int.from_bytes(data[at_entry:at_entry + 2], "little")):
        entry = data[at_entry + 2 + 12 * k:at_entry + 14 + 12 * k]
        tag, kind, count = (int.from_bytes(entry[a:b], "little") for a, b in ((0, 2), (2, 4), (4, 8)))
        where = int.from_bytes(entry[8:12], "little") if sizes[kind] * count > 4 else at_entry + 10 + 12 * k
        tags[tag] = np.frombuffer(data, kinds[kind], count, where)
    width, height, tile = int(tags[256][0]), int(tags[257][0]), int(tags[322][0])
    signed = int(tags.get(339, [1])[0]) == 2
    across = -(-width // tile)
    image = np.zeros((-(-height // tile) * tile, across * tile), "<i2" if signed else "<u2")
    for k, (offset, count) in enumerate(zip(tags[324], tags[325])):
        block = np.frombuffer(zlib.decompress(data[int(offset):int(offset) + int(count)]), "<u2").reshape(tile, tile)
        block = np.cumsum(block, axis=1, dtype=np.uint16).view(image.dtype)
        image[k // across * tile:(k // across + 1) * tile, k % across * tile:(k % across + 1) * tile] = block
    return image[:height, :width].astype(float)


class Maps:
    """The three maps and how the scene lays them over each other, with cubics and weights of its own."""

    def __init__(self, files):
        self.ldem = np.frombuffer(files[0].with_suffix(".IMG").read_bytes(), "<i2").reshape(720, 1440) * 0.5
        self.strip = read_tiff(files[1])
        self.site = -523.2 + 0.0378835736629282 * read_tiff(files[2])

    def global_height(self, longitude, latitude):
        """Across the south pole the other side's rows follow; within three rows of it, a grid of squares about it is gone over to."""
        over = np.concatenate([self.ldem[-60:], np.roll(self.ldem[:-9:-1], 720, axis=1)])
        y = (90 - latitude) * 4 - 0.5
        near = y > 700
        height = np.empty_like(y)
        for part, values, first in ((~near, self.ldem, 0), (near, over, 660)):
            height[part] = cubic_of_thinned(values, longitude[part] * 4 - 0.5, y[part] - first, latitude[part], wraps=True)
        rows = 719.5 - y
        close = rows < 3
        if close.any():
            turn = np.radians(longitude[close])
            cap = cubic(self.polar_grid(over), rows[close] * np.cos(turn) + 4, rows[close] * np.sin(turn) + 4)
            height[close] += smoothstep(1.5 * (1 - rows[close] / 3)) * (cap - height[close])
        return height

    @staticmethod
    def polar_grid(over):
        """Heights at whole rows east and north of the south pole, -4 to 4; the pole itself is the mean of all longitudes."""
        rings = {row: thinned(over[row][None], 4 * math.ceil(math.pi * max(from_pole, 0.5)), True)
                 for from_pole in range(8) for row in (59 - from_pole, 60 + from_pole)}
        grid = np.zeros((9, 9))
        for j in range(9):
            for i in range(9):
                distance, turn = math.hypot(i - 4, j - 4), math.atan2(j - 4, i - 4) / (2 * math.pi) % 1
                y = 59.5 - distance
                for b, weight in enumerate(catmull_rom(y - math.floor(y))):
                    ring = rings[math.floor(y) + b - 1]
                    value = cubic(ring, np.array([turn * ring.shape[1] - 0.5]), np.zeros(1), wraps=True)[0] if distance > 0 else ring.mean()
                    grid[j, i] += weight * value
        return grid

    def height(self, p):
        """Above the sphere, of directions in rows."""
        radius = np.linalg.norm(p, axis=1)
        longitude = np.degrees(np.arctan2(p[:, 1], p[:, 0])) % 360
        latitude = np.degrees(np.arcsin(p[:, 2] / radius))
        height = self.global_height(longitude, latitude)
        # Distances from the sides, two samples inside them, in metres on the sphere.
        x, y = (longitude - 216) * 64 - 0.5, (-42 - latitude) * 64 - 0.5
        pixel = RADIUS_M * math.radians(1 / 64)
        aside = (np.minimum(x, 1023 - x) - 1.5) * pixel * np.cos(np.radians(latitude))
        along = (np.minimum(y, 3070 - y) - 1.5) * pixel
        w = smoothstep(np.minimum(aside, along) / 4000)
        inside = w > 0
        height[inside] += w[inside] * (cubic_of_thinned(self.strip, x[inside], y[inside], latitude[inside]) - height[inside])
        rho = 2 * RADIUS_M * np.tan(np.radians(90 + latitude) / 2)
        i = (rho * np.sin(np.radians(longitude)) + 19000) / 10 - 0.5
        j = (-4000 - rho * np.cos(np.radians(longitude))) / 10 - 0.5
        scale = 1 + (rho / (2 * RADIUS_M))**2  # of the projection
        w = smoothstep((np.minimum(np.minimum(i, 1599 - i), np.minimum(j, 1599 - j)) - 1.5) * 10 / scale / 1500)
        inside = (w > 0) & (latitude < -80)
        height[inside] += w[inside] * (cubic(self.site, i[inside], j[inside]) - height[inside])
        return height


def smoothstep(t):
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)


def catmull_rom(t):
    return (-0.5 * t**3 + t**2 - 0.5 * t, 1.5 * t**3 - 2.5 * t**2 + 1, -1.5 * t**3 + 2 * t**2 + 0.5 * t, 0.5 * t**3 - 0.5 * t**2)


def thinned(values, count, wraps):
    """Rows with `count` columns: means, less what the mean of a parabola exceeds its middle by."""
    width = values.shape[1]
    sums = np.concatenate([np.zeros((len(values), 1)), np.cumsum(values, axis=1)], axis=1)
    edges = np.arange(count + 1) * (width / count)
    whole = np.minimum(edges.astype(int), width - 1)
    means = np.diff(sums[:, whole] + (edges - whole) * values[:, whole], axis=1) * (count / width)
    around = np.pad(means, ((0, 0), (1, 1)), "wrap" if wraps else "edge")
    return means - (1 - (count / width)**2) / 24 * (around[:, :-2] - 2 * means + around[:, 2:])


def cubic_of_thinned(values, x, y, latitude, wraps=False):
    """Columns are taken together where they are closer than a third of the distance of rows."""
    width = values.shape[1]
    aspect = 1 / np.cos(np.radians(latitude))
    columns = np.where(aspect > 3, 0.75 * aspect - 3.75 / aspect, 1)
    halvings = np.minimum(np.floor(np.log2(columns)).astype(int), int(math.log2(width / (8 if wraps else 1))))
    height = np.empty_like(x)
    for k in np.unique(halvings):
        part = halvings == k
        pair = []
        for times in (k, k + 1):
            wide = width / 2**times
            count = width if times == 0 else int(2 * math.ceil(wide / 2) if wraps else math.ceil(wide))
            level = values if times == 0 else thinned(values, count, wraps)
            pair.append(cubic(level, (x[part] + 0.5) * count / width - 0.5, y[part], wraps))
        height[part] = pair[0] + smoothstep(columns[part] / 2**k - 1) * (pair[1] - pair[0])
    return height


def cubic(values, x, y, wraps=False):
    """Catmull-Rom between samples."""
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    across, down = catmull_rom(x - i), catmull_rom(y - j)
    height, width = values.shape
    total = 0
    for b in range(4):
        row = np.clip(j + b - 1, 0, height - 1)
        for a in range(4):
            column = (i + a - 1) % width if wraps else np.clip(i + a - 1, 0, width - 1)
            total = total + down[b] * across[a] * values[row, column]
    return total


def limited(obscura, *arguments):
    """What the program prints, under the limit of memory."""
    limit = LIMIT_MIB << 20
    # Address space that malloc sets aside for each thread is no memory.
    environment = {**os.environ, "MALLOC_ARENA_MAX": "1"}
    done = subprocess.run([obscura, *map(str, arguments)], capture_output=True, text=True, check=False, env=environment,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
    if done.returncode != 0:
        sys.exit(f"obscura {' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return done.stdout


def baked(obscura, folder, files, spacing_m, path, options, pictures, report):
    """The four altitudes from a giant texture of what the scene has within 30 degrees of the pole."""
    scene, cap = folder / "bake.toml", folder / "cap.obt"
    scene.write_text(scene_text(files, path, 0, 64, SUN_ELEVATION_DEG, DETAIL))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    case_files.run(obscura, "texture", "bake", scene, "-o", cap, "--projection", "south_polar_stereographic", "--within", 30, "--spacing",
                   spacing_m)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    report.say("baked within 30 degrees of the pole", f"{cap.stat().st_size / 1e9:.2f} GB in {after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime:.0f} s of processor time",
               f"`obscura texture bake`, samples of {spacing_m:g} m; {(14 / spacing_m)**2:.3g} of the whole, which is 36 GB at 14 m")
    more = []
    for share, virtual in zip(SHOWN, pictures):
        text = scene_text([files[0], cap, files[2]], path, share, options.size, SUN_ELEVATION_DEG, DETAIL, (LAYERS[0], "priority = 1\n", LAYERS[2]))
        layers, told = render(obscura, folder, "baked", text, options.samples)
        more.append(layers[""])
        report.add(f"baked frame at {path.altitude(share) / 1000:.3g} km", f"{told['render_cpu_s']:.1f} s of processor time; mean light {layers[''].mean() / virtual.mean():.4f} of the virtual frame's",
                   "the virtual frame", abs(layers[""].mean() / virtual.mean() - 1), 0.05, "")
    return more


def render(obscura, folder, name, text, samples, *more):
    scene, image = folder / f"{name}.toml", folder / f"{name}.fits"
    scene.write_text(text)
    told = json.loads(limited(obscura, "render", scene, "-o", image, "--samples", samples, "--json", *more))
    return {key.lower(): value for key, value in case_files.read_fits(image)[1].items()}, told


def check_points(report, maps, path, share, size, layers):
    """The points met lie on the surface that the maps make."""
    place, look, up, pixel = path.camera(share, size)
    x = np.cross(look, up)
    x /= np.linalg.norm(x)
    axes = np.stack([x, np.cross(look, x), look], axis=1)
    middle = (np.arange(size) - (size - 1) / 2) * pixel
    u, v = np.meshgrid(middle, middle)
    rays = np.stack([u, v, np.ones_like(u)], axis=-1)
    rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True) @ axes.T
    reach = layers["range_m"]
    hit = np.isfinite(reach) & (reach > 0)
    points = place + reach[hit][:, None] * rays[hit]
    off = np.abs(np.linalg.norm(points, axis=1) - RADIUS_M - maps.height(points)) / (reach[hit] * pixel)
    report.add(f"points met from {path.altitude(share) / 1000:.3g} km", f"{hit.sum()} of them, median {np.median(off):.4f}, 99 % within "
               f"{np.percentile(off, 99):.3f} of a pixel's width", "the maps, interpolated and blended on their own", np.percentile(off, 99), 0.05, "px")


def picture(file):
    """Irradiance of a FITS file of one float image."""
    data = file.read_bytes()
    cards = {data[at:at + 8].strip(): data[at + 10:at + 30].strip() for at in range(0, 80 * 36, 80)}
    width, height = int(cards[b"NAXIS1"]), int(cards[b"NAXIS2"])
    begin = (data.index(b"END" + b" " * 77) // 2880 + 1) * 2880
    return np.frombuffer(data, ">f4", width * height, begin).astype(float).reshape(height, width)


def cost_of_frames(obscura, folder, files, path, options, report):
    """Processor time of a frame within a flight of FLIGHT_FRAMES frames. That of making the first frame's tiles, which a frame of one
    sample shows, is taken out."""
    totals = {}
    for share in SHOWN:
        table = folder / "flight.csv"
        table.write_text("time_s,x_m,y_m,z_m\n" + "".join(
            f"{k}," + ",".join(f"{c!r}" for c in map(float, path.place(share + step / FLIGHT_FRAMES))) + "\n"
            for k, step in enumerate((0, 1) if share == 0 else (-1, 0))))

        def cost(name, size, text, *settings):
            scene = folder / f"{name}.toml"
            scene.write_text(text)
            return json.loads(limited(obscura, "render", scene, "-o", folder / f"{name}%02d.fits", "--size", f"{size}x{size}", "--threads",
                                      options.threads, "--json", *settings))

        said, pictures, noise = [], {}, None
        for sun in "traced", "tiles":
            body = f'cell_px = {options.cell_px}\nsun_visibility = "{sun}"'
            one = scene_text(files, path, share, options.size, SUN_ELEVATION_DEG, DETAIL, body=body)
            two = scene_text(files, path, share, options.size, SUN_ELEVATION_DEG, DETAIL, trajectory=table, body=body)
            tiles = cost("one", options.size, one, "--samples", 1)["render_cpu_s"]
            fixed = cost("two", options.size, two, "--trajectory", "--samples", options.samples)
            pictures[sun] = picture(sorted(folder.glob("two*.fits"))[-1])
            noise = noise or fixed["noise_rms"]
            error = 4 * noise
            while True:
                adaptive = cost("two", options.size, two, "--trajectory", "--samples", 8, "--error", f"{error:.2g}", "--max-samples",
                                16 * options.samples)
                if adaptive["noise_rms"] <= noise:
                    break
                error *= 0.9 * noise / adaptive["noise_rms"]
            for kind, told in (("fixed", fixed), ("adaptive", adaptive)):
                frame = (told["render_cpu_s"] - tiles) / 2
                totals.setdefault((sun, kind), []).append(frame)
                said.append(f"{frame:.1f} s, {told['samples'] / 2e6:.1f} M samples, noise {100 * told['noise_rms']:.2f} %")
        difference = pictures["tiles"] - pictures["traced"]
        rms = math.sqrt(np.mean(pictures["traced"] ** 2))
        report.say(f"{path.altitude(share) / 1000:.3g} km, {-path.latitude(share):.2f} S", *said,
                   f"{100 * difference.mean() / pictures['traced'].mean():+.2f} %, {100 * math.sqrt(np.mean(difference ** 2)) / rms:.1f} % rms")
    report.say("mean of the four", *(f"{np.mean(values):.1f} s" for values in totals.values()))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("obscura")
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--sheet", default="24,192,16", help="frames of the contact sheet, their size and samples")
    parser.add_argument("--baked", type=float, help="distance of samples of the baked texture, m")
    parser.add_argument("--output", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--cost", action="store_true")
    parser.add_argument("--cell-px", type=float, default=1)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    files = [case_files.data_file(name) for name in (GLOBAL, STRIP, SITE)]
    report, maps = Report(), Maps(files)
    ground = maps.height(at(LONGITUDE, END_LATITUDE)[None])[0]
    path = Path(float(ground))
    frames, sheet_size, sheet_samples = map(int, options.sheet.split(","))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if options.cost:
            costs = Report((f"{options.samples} samples", "adaptive, to that noise", f"kept sunlight, {options.samples} samples",
                            "kept sunlight, adaptive, to the noise of the first", "kept sunlight less shadow rays, mean and rms of pixels"))
            cost_of_frames(options.obscura, folder, files, path, options, costs)
            costs.print()
            if options.output:
                costs.into_page(options.output / "lunar-south-pole.md", "cost")
            return 0
        notes = []
        for share in SHOWN:
            layers, told = render(options.obscura, folder, "points", scene_text(files, path, share, 160, SUN_ELEVATION_DEG, ""), 1, "--layers")
            check_points(report, maps, path, share, 160, layers)
            notes = [note for body in told["plausibility"]["bodies"] for note in body.get("notes", [])]
        for note in notes:
            report.say("overlap", note.rsplit("/", 1)[-1], "stated by `obscura render`")
        pictures = []
        for share in SHOWN:
            layers, told = render(options.obscura, folder, "shown", scene_text(files, path, share, options.size, SUN_ELEVATION_DEG, DETAIL),
                                  options.samples)
            pictures.append(layers[""])
            light = layers[""][layers[""] > 0]
            report.say(f"frame at {path.altitude(share) / 1000:.3g} km, {-path.latitude(share):.2f} S",
                       f"{told['render_cpu_s']:.1f} s of processor time, {told['samples'] / 1e6:.1f} M samples, {told['rays'] / 1e6:.1f} M rays",
                       f"{options.size}² pixels, {options.samples} samples; {100 * light.size / layers[''].size:.0f} % of the pixels lit")
        peak_mib = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
        rows_of_four = [pictures]
        if options.baked:
            rows_of_four.append(baked(options.obscura, folder, files, options.baked, path, options, pictures, report))
        sheet, costs = [], []
        for k in range(frames):
            share = k / max(frames - 1, 1)
            layers, told = render(options.obscura, folder, "sheet", scene_text(files, path, share, sheet_size, SUN_ELEVATION_DEG, DETAIL), sheet_samples)
            sheet.append(layers[""])
            costs.append(told["render_cpu_s"])
        report.say("contact sheet", f"{np.median(costs):.2f} s of processor time a frame, the costliest {max(costs):.2f}",
                   f"{frames} frames of {sheet_size}² pixels, {sheet_samples} samples")
        report.say("memory of the renderer", f"{peak_mib:.0f} MiB at most",
                   f"tile_memory_mib is {TILES_MIB}; all frames ran under a limit of {LIMIT_MIB} MiB of address space (RLIMIT_AS)")
        if options.output:
            case_files.write_png(options.output / "lunar-south-pole.png", stacked(rows_of_four))
            columns = 6
            case_files.write_png(options.output / "lunar-south-pole-sheet.png", stacked([sheet[r:r + columns] for r in range(0, len(sheet), columns)]))
            report.into_page(options.output / "lunar-south-pole.md")
    report.print()
    if options.json:
        options.json.write_text(json.dumps(report.figures))
    return 0 if report.good else 1


def stacked(rows):
    """Rows of pictures below each other, those that are as long as the first."""
    lines = [case_files.beside(*(shown(p) for p in row)) for row in rows if len(row) == len(rows[0])]
    gap = np.full((6, lines[0].shape[1]), 255, np.uint8)
    return np.concatenate([part for line in lines for part in (line, gap)][:-1])


def shown(image):
    return case_files.grey(image, 0, np.percentile(image[image > 0], 99.5) if (image > 0).any() else 1, 1.8)


if __name__ == "__main__":
    sys.exit(main())
